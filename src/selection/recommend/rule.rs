//! Rule for taking a step: its gain at postures that were not fitted must be large and significant in every division of
//! the campaign.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::diagnosis::folds::Division;
use crate::math::nearest_rank;

/// Smallest gain that counts, as a share of the mean square (decision 0025).
const LEAST_GAIN: f64 = 0.05;

/// Largest loss that counts as harmless when whole places are left out, as a share of the mean square.
const LEAST_HARM: f64 = 0.02;

/// Two-sided significance level of a gain: two standard errors of the paired differences with many postures, and more
/// with few, by Student's t distribution. One standard error has proved too little (decision 0025).
const CHANCE: f64 = 0.0455;

/// Squares are clipped at this multiple of their median, so that a few bad postures decide nothing (decision 0025).
const CLIP: f64 = 3.0;

/// The 95th percentile may not grow by more than this share.
const TAIL: f64 = 0.10;

/// Gain of a step at left-out postures, by one division.
///
/// ```
/// use calibench::diagnosis::folds::Division;
/// use calibench::selection::recommend::{Gain, Insufficient};
///
/// // A fifth of the squares, at 40 postures: convincing by four standard errors, not by one.
/// let gain = Gain { division: Division::Random, postures: 40, rms: [1e-4, 9e-5], share: 0.2, sigma: 4.0, tail: 0.9 };
/// assert!(gain.convinces());
/// let by_chance = Gain { sigma: 1.0, ..gain };
/// assert!(matches!(by_chance.lacks(), Some(Insufficient::Significance { needed }) if needed > 2.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Kind of division.
    pub division: Division,
    /// Number of postures judged.
    pub postures: usize,
    /// Root mean square of the 3-D error before and after, m.
    pub rms: [f64; 2],
    /// Reduction of the clipped mean square, as a share.
    pub share: f64,
    /// The gain in standard errors of the paired differences.
    pub sigma: f64,
    /// 95th percentile of the error after over that before.
    pub tail: f64,
}

impl Gain {
    /// Computes the gain from the mean squares of each posture (m²) before and after; `None` with fewer than four
    /// postures.
    pub(crate) fn of(division: Division, before: &[Option<f64>], after: &[Option<f64>]) -> Option<Self> {
        let pairs: Vec<[f64; 2]> = before.iter().zip(after).filter_map(|(b, a)| Some([(*b)?, (*a)?])).collect();
        let n = pairs.len() as f64;
        if pairs.len() < 4 {
            return None;
        }
        let column = |k: usize| pairs.iter().map(|p| p[k]).collect::<Vec<f64>>();
        let clip = CLIP * nearest_rank(column(0), 0.5);
        let clipped: Vec<[f64; 2]> = pairs.iter().map(|p| p.map(|x| x.min(clip))).collect();
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| clipped.iter().map(of).sum::<f64>() / n;
        let gained = mean(&|p| p[0] - p[1]);
        let spread = mean(&|p| (p[0] - p[1] - gained).powi(2));
        let error = (spread / (n - 1.0)).sqrt();
        let tail = |k: usize| nearest_rank(column(k), 0.95).sqrt();
        Some(Gain {
            division,
            postures: pairs.len(),
            rms: [0, 1].map(|k| (column(k).iter().sum::<f64>() / n).sqrt()),
            share: gained / mean(&|p| p[0]).max(f64::MIN_POSITIVE),
            sigma: if error > 0.0 { gained / error } else { 0.0 },
            tail: tail(1) / tail(0).max(f64::MIN_POSITIVE),
        })
    }

    /// True if the gain is large and significant; with whole places left out, true if the step does no harm.
    pub fn convinces(&self) -> bool {
        self.lacks().is_none()
    }

    /// Why the gain is not significant; `None` if it is.
    pub fn lacks(&self) -> Option<Insufficient> {
        let needed = least_sigma(self.postures);
        if self.share.is_nan() {
            return Some(Insufficient::Gain);
        }
        if self.division == Division::Places {
            return (self.share <= -LEAST_HARM).then_some(Insufficient::Gain);
        }
        match self.share {
            none if none <= 0.0 => Some(Insufficient::Gain),
            small if small <= LEAST_GAIN => Some(Insufficient::Size { needed: LEAST_GAIN }),
            _ if self.sigma <= needed => Some(Insufficient::Significance { needed }),
            _ if self.tail >= 1.0 + TAIL => Some(Insufficient::Tail { grows: self.tail - 1.0 }),
            _ => None,
        }
    }
}

/// Why a gain is not significant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Insufficient {
    /// There is none.
    Gain,
    /// It is too small.
    Size {
        /// The share of the mean square that it must exceed.
        needed: f64,
    },
    /// Chance may have brought it about.
    Significance {
        /// The number of standard errors that it must exceed.
        needed: f64,
    },
    /// The errors are smaller on the whole, but the largest ones grow.
    Tail {
        /// By this share, at the 95th percentile.
        grows: f64,
    },
}

/// Number of standard errors that a gain must exceed with this number of postures.
fn least_sigma(postures: usize) -> f64 {
    StudentsT::new(0.0, 1.0, postures.saturating_sub(1).max(1) as f64)
        .map_or(f64::INFINITY, |t| t.inverse_cdf(1.0 - CHANCE / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_is_told_from_chance() {
        let before: Vec<Option<f64>> = (0..40).map(|k| Some(1.0 + 0.3 * (k as f64).sin())).collect();
        let better: Vec<Option<f64>> = before.iter().map(|b| b.map(|b| 0.7 * b)).collect();
        let alike: Vec<Option<f64>> = (0..40).map(|k| Some(1.0 + 0.3 * (1.7 * k as f64).cos())).collect();
        let gain = |after: &[Option<f64>]| Gain::of(Division::Random, &before, after).expect("forty postures");
        assert!(gain(&better).convinces() && (gain(&better).share - 0.3).abs() < 1e-9);
        assert!(!gain(&alike).convinces() && !gain(&before).convinces());
        assert!(Gain::of(Division::Random, &before[..3], &better[..3]).is_none());
    }

    #[test]
    fn one_bad_posture_decides_nothing() {
        let mut before = vec![Some(1.0); 30];
        before[3] = Some(1e6);
        let mut after = before.clone();
        after[3] = Some(1.0);
        assert!(!Gain::of(Division::Time, &before, &after).expect("thirty").convinces());
    }
}
