//! What the model leaves above the noise.

use super::significance::SIGNIFICANCE;
use crate::assess::noise_floor::{NoiseFloor, NoiseSource, fisher_chance};
use crate::assess::residual_views::Whitened;

/// Quantile of the normal distribution for 95 %, two-sided.
const TWO_SIDED_95: f64 = 1.959_964;

/// Residual against noise: the classic test of lack of fit (Draper and Smith 1998, 2.1) where there are replicates, chi-square
/// against the stated noise elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LackOfFit {
    /// Degrees of freedom of the residuals: numbers measured, less the parameters that they determined.
    pub dof: f64,
    /// Residual sum of squares in units of the noise squared, by its degrees of freedom; `None` where the noise is unknown.
    pub chi2_per_dof: Option<f64>,
    /// Chance that noise alone leaves as much; `None` where the noise is unknown, or all rows are replicates of as many targets as
    /// there are parameters.
    pub p: Option<f64>,
    /// What noise leaves of the residual, 3-D rms, m: less than the noise itself after a fit, `noise² dof / numbers`.
    pub noise_left: Option<f64>,
    /// Root of rms² less that, 3-D, m; zero where noise explains all.
    pub unexplained: Option<f64>,
    /// Where that lies with 95 % confidence, m, if what is unexplained stays as it is and the noise is drawn again.
    pub interval: Option<[f64; 2]>,
    /// Whether less is left than the stated noise would leave, at 1 %: it is stated too large to judge anything by.
    pub noise_overstated: bool,
}

impl LackOfFit {
    pub(super) fn of(noise: &NoiseFloor, rms: f64, whitened: &Whitened, numbers: usize) -> Self {
        let Whitened { squares, dof, least_dof, .. } = *whitened;
        let nothing = LackOfFit {
            dof,
            chi2_per_dof: None,
            p: None,
            noise_left: None,
            unexplained: None,
            interval: None,
            noise_overstated: false,
        };
        let Some(level) = noise.level else { return nothing };
        let relative = squares / (level.relative * level.relative);
        let p = match (noise.source, noise.replicates) {
            (NoiseSource::Replicates, Some(pure)) if dof > pure.dof => {
                let above = dof - pure.dof;
                let ratio = ((squares - pure.squares).max(0.0) / above) / (pure.squares / pure.dof);
                fisher_chance(ratio, above, pure.dof)
            }
            (NoiseSource::Replicates, _) => None,
            _ => noise.chance_of(squares, dof),
        };
        let share = (dof / numbers.max(1) as f64).clamp(0.0, 1.0);
        let noise_left = level.rms * share.sqrt();
        let unexplained = rms * rms - noise_left * noise_left;
        // rms² is noise²/numbers times a chi-square whose non-centrality stands for what is unexplained; its variance is
        // 2 (dof + 2 lambda). Noise known from replicates adds its own.
        let per_number = level.rms * level.rms / numbers.max(1) as f64;
        let lambda = if per_number > 0.0 { unexplained.max(0.0) / per_number } else { 0.0 };
        let own = per_number * (2.0 * (dof + 2.0 * lambda)).sqrt();
        let of_noise = level.dof.map_or(0.0, |known| noise_left * noise_left * (2.0 / known).sqrt());
        let reach = TWO_SIDED_95 * own.hypot(of_noise);
        LackOfFit {
            dof,
            chi2_per_dof: (dof > 0.0).then_some(relative / dof),
            p,
            noise_left: Some(noise_left),
            unexplained: Some(unexplained.max(0.0).sqrt()),
            interval: Some([-reach, reach].map(|by| (unexplained + by).max(0.0).sqrt())),
            // Effects that are held to a size take up noise, however wide they are held.
            noise_overstated: noise.source == NoiseSource::Stated
                && noise.chance_of(squares, least_dof.min(dof)).is_some_and(|p| p > 1.0 - SIGNIFICANCE),
        }
    }
}
