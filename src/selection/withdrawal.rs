//! Test of a chosen model on rows that were used neither for fitting nor for the choice.

use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::problem::Use;
use crate::measure::dataset::NamedDataset;
use crate::measure::poses::Postures;

/// Number of standard errors of the paired differences by which the squared errors must increase to count as worse (decision
/// 0025).
const SIGNIFICANT: f64 = 2.0;

/// The same for the rows that judge a recommendation: where it is no better it is not needed, and where it is better by what makes
/// it worth while, it seems worse by so much once in hundreds.
const SEEMS_WORSE: f64 = 1.0;

/// Share by which the rms must increase as well.
const WORSE: f64 = 0.01;

/// Contradiction of a step by rows that were not fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contradiction {
    /// Rms of the 3-D error before and after, m.
    pub rms: [f64; 2],
    /// Increase of the mean squared error in standard errors.
    pub sigma: f64,
}

impl Contradiction {
    /// Compares squared errors (m²) of the same rows before and after, given the posture index of each row; `None`
    /// unless they are significantly larger, or with fewer than three postures.
    pub fn of(before: &[f64], after: &[f64], posture: &[usize]) -> Option<Self> {
        Contradiction::beyond(SIGNIFICANT, before, after, posture)
    }

    /// As [`Contradiction::of`], for an increase by this many standard errors.
    pub(crate) fn beyond(least: f64, before: &[f64], after: &[f64], posture: &[usize]) -> Option<Self> {
        let count = posture.iter().max().map_or(0, |p| p + 1);
        let mut differences = vec![(0.0, 0.0); count];
        for ((b, a), &p) in before.iter().zip(after).zip(posture) {
            differences[p] = (differences[p].0 + a - b, differences[p].1 + 1.0);
        }
        let each: Vec<f64> = differences.iter().filter(|d| d.1 > 0.0).map(|d| d.0 / d.1).collect();
        let n = each.len() as f64;
        if n < 3.0 {
            return None;
        }
        let mean = each.iter().sum::<f64>() / n;
        let error = (each.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        let rms = [before, after].map(|squares| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt());
        let sigma = mean / error.max(f64::MIN_POSITIVE);
        (sigma > least && rms[1] > rms[0] * (1.0 + WORSE)).then_some(Contradiction { rms, sigma })
    }
}

/// Tests whether the rows of set `validation`, which the choice did not use, contradict `after` in favour of `before`.
pub(crate) fn contradicted(
    datasets: &[NamedDataset<'_>],
    before: &Calibration,
    after: &Calibration,
) -> Result<Option<Contradiction>, IdentifyError> {
    if !datasets.iter().any(|d| d.dataset.samples.iter().any(|s| Use::Validation.takes(s))) {
        return Ok(None);
    }
    let squares = |c: &Calibration| -> Result<Vec<f64>, IdentifyError> {
        Ok(c.predict(datasets, Use::Validation)?.residuals.iter().map(|r| r.norm_squared()).collect())
    };
    let postures = Postures::of(datasets, |s| Use::Validation.takes(s));
    Ok(Contradiction::beyond(SEEMS_WORSE, &squares(before)?, &squares(after)?, postures.of_samples()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_surely_worse_contradicts_and_what_may_be_chance_does_not() {
        let posture: Vec<usize> = (0..30).collect();
        let before: Vec<f64> = (0..30).map(|k| 1.0 + 0.2 * (k as f64).sin()).collect();
        let worse: Vec<f64> = before.iter().map(|b| 1.3 * b).collect();
        let chance: Vec<f64> = (0..30).map(|k| 1.0 + 0.2 * (2.3 * k as f64).cos()).collect();
        assert!(Contradiction::of(&before, &worse, &posture).is_some_and(|c| c.sigma > 5.0));
        assert!(Contradiction::of(&before, &chance, &posture).is_none());
        assert!(Contradiction::of(&worse, &before, &posture).is_none());
        // Repeats of one posture count as one observation.
        assert!(Contradiction::of(&before, &worse, &[0; 30]).is_none());
    }
}
