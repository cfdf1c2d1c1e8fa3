//! The error to expect at given postures: as measured at postures that are as far from the data as these.

use super::divisions::Measured;
use crate::diagnosis::folds::Division;

/// Leverage beyond which a campaign cannot predict: nothing that was left out was as far.
const MOST_LEVERAGE: f64 = 0.8;

/// Mean length over its root mean square, of the errors of a robot.
const MEAN_OVER_RMS: f64 = 0.92;

/// Added to a leverage before its logarithm.
const LEAST_LEVERAGE: f64 = 1e-3;

/// Terms of the standard deviation of a level's logarithm: always; times the root of one over the number of postures; times the
/// leverage, to at most this one.
const BAND: (f64, f64, f64, f64) = (0.10, 0.42, 0.3, 1.5);

/// The mean length of the error to expect at given postures, noise of the instrument included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Expected {
    /// How far the postures are from the data, as the model alone sees it.
    pub leverage: f64,
    /// As measured at left-out postures as far as these, m.
    pub measured: f64,
    /// As the model's own covariance has it, m.
    pub own: f64,
    /// Standard deviation of the logarithm of the level.
    pub spread: f64,
}

impl Expected {
    /// The level, m.
    pub fn level(&self) -> f64 {
        self.measured.max(self.own)
    }

    /// True if the data cannot predict there: the level is then a least one.
    pub fn is_refused(&self) -> bool {
        self.leverage > MOST_LEVERAGE
    }

    /// From what the divisions measured without the field (`which` 0) or with it (1); `variances` are those of the predictions
    /// at the postures without noise, each over three axes, and `noise2` that of the noise of an axis, m².
    pub(super) fn of(divisions: &[Measured], which: usize, leverage: f64, variances: &[f64], noise2: f64) -> Self {
        let count = variances.len().max(1) as f64;
        let lengths = variances.iter().map(|v| (v + 3.0 * noise2).sqrt());
        let (always, postures, far, most) = BAND;
        Expected {
            leverage,
            measured: interpolated(divisions, which, leverage),
            own: MEAN_OVER_RMS * lengths.sum::<f64>() / count,
            spread: (always * always + postures * postures / count + (far * leverage.min(most)).powi(2)).sqrt(),
        }
    }
}

/// Leverage of given postures: root of the mean variance of the model alone over that of the noise.
pub(super) fn leverage(variances: &[f64], noise2: f64) -> f64 {
    (variances.iter().sum::<f64>() / variances.len().max(1) as f64 / (3.0 * noise2)).sqrt()
}

fn log_leverage(leverage: f64) -> f64 {
    (leverage + LEAST_LEVERAGE).ln()
}

/// Logarithm of the measured level, interpolated over that of the leverage; flat outside. Parts in time are no distance.
fn interpolated(divisions: &[Measured], which: usize, leverage: f64) -> f64 {
    let of_space = divisions.iter().filter(|d| d.parting.division != Division::Time);
    let mut points: Vec<[f64; 2]> = of_space.map(|d| [log_leverage(d.leverage), d.errors[which].ln()]).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let at = log_leverage(leverage);
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return 0.0 };
    let between = points.windows(2).find(|pair| at >= pair[0][0] && at < pair[1][0]);
    let level = match between {
        Some(&[[x0, y0], [x1, y1]]) => y0 + (y1 - y0) * (at - x0) / (x1 - x0),
        _ if at < first[0] => first[1],
        _ => last[1],
    };
    level.exp()
}

#[cfg(test)]
mod tests {
    use super::super::divisions::Parting;
    use super::*;

    fn measured(division: Division, leverage: f64, error: f64) -> Measured {
        Measured { parting: Parting { division, count: 3 }, leverage, errors: [error; 2], gain: 0.0, sigma: 0.0 }
    }

    #[test]
    fn the_level_is_that_of_postures_as_far_away() {
        let all =
            [measured(Division::Blocks, 0.4, 4e-4), measured(Division::Random, 0.1, 1e-4), measured(Division::Time, 0.2, 9.0)];
        let at = |leverage: f64| interpolated(&all, 0, leverage);
        assert!((at(0.05) - 1e-4).abs() < 1e-18 && (at(3.0) - 4e-4).abs() < 1e-18);
        // Half way in the logarithm.
        let half = (0.101_f64 * 0.401).sqrt() - 0.001;
        assert!((at(half) - 2e-4).abs() < 1e-12, "{}", at(half));
        assert_eq!(interpolated(&[], 0, 1.0), 0.0);
    }

    #[test]
    fn far_postures_are_refused() {
        let near = Expected::of(&[], 0, 0.8, &[1e-10; 9], 1e-10);
        assert!(!near.is_refused() && Expected { leverage: 0.81, ..near }.is_refused());
        assert!((near.own - 0.92 * 2e-5).abs() < 1e-12);
        assert!((near.spread - (0.01_f64 + 0.0196 + 0.0576).sqrt()).abs() < 1e-12);
    }
}
