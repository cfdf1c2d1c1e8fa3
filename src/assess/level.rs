//! The level of the error to expect, held against what the campaign itself measures: postures left out of the fit.
//!
//! Draws of what ordinary physics allows tell the shape of the error over the workspace, and where it grows. Their level is a matter of
//! what is thought plausible, and on robots that err by something else it is wrong by factors either way. At the fitted postures both are
//! known: what the draws expect there, and by how much postures are missed that were left out.

use nalgebra::{DMatrix, DVector};

use super::cross_validation::cross_validated;
use super::examination::Examination;
use super::recommend::random_folds;

/// Postures looked at; of more, every so many-th.
const MOST: usize = 600;

/// How the draws are put right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Level {
    /// Factor of the draws: less than one where they expect more than is measured.
    pub factor: f64,
    /// One-sigma per axis of what looks like noise and is more than the instrument's, m: robot, at every pose another.
    pub white: f64,
    /// Mean length of the error at postures left out of the fit, the instrument's noise taken off, m.
    pub left_out: f64,
    /// Standard deviation of the logarithm of the level.
    pub spread: f64,
}

/// A chi-square so many standard deviations below its degrees of freedom says that the noise is overstated (chance 2e-4): it is then no
/// ground to take anything off.
const OVERSTATED: f64 = 3.5;

/// Mean of the length of a vector of three normal numbers of one-sigma 1.
const MEAN_LENGTH: f64 = 1.595_769_121_605_731;

impl Level {
    /// From the draws of the fitted parameters' errors (SI) and of the candidates' sizes: a column a draw.
    pub fn of(examination: &Examination, parameters: &DMatrix<f64>, sizes: &DMatrix<f64>) -> Self {
        let Examination { rows, circumstances, problem, fit, fitted, .. } = examination;
        let samples: Vec<usize> = (0..circumstances.len()).step_by(circumstances.len().div_ceil(MOST).max(1)).collect();
        let unit = examination.squared_units();
        let stated = 3.0 * unit.iter().sum::<f64>() * examination.yardstick.weight().powi(2);
        let dof = fit.dof as f64;
        let overstated = fit.chi2 < dof - OVERSTATED * (2.0 * dof).sqrt();
        let noise2 = if problem.noise_stated() && !overstated { stated / circumstances.len().max(1) as f64 / 3.0 } else { 0.0 };
        let missed = cross_validated(examination, &random_folds(circumstances), 0..0);
        let whole = |s: usize| 3.0 / circumstances[s].height as f64;
        let lengths: Vec<f64> = (0..circumstances.len()).map(|s| (missed[s] * unit[s] * whole(s)).sqrt()).collect();
        let usual = median(&lengths).max(f64::MIN_POSITIVE);
        // A few bad samples are no level.
        let clipped: Vec<f64> = lengths.iter().map(|l| l.min(5.0 * usual)).collect();
        let measured2 = (mean(&clipped) / MEAN_LENGTH).powi(2);

        let m = fitted.len();
        let mut expected = 0.0;
        let mut count = 0.0;
        for &s in &samples {
            let at = &circumstances[s];
            let mut squares = DVector::<f64>::zeros(sizes.ncols());
            for k in at.first_row..at.first_row + at.height {
                let row = rows.column(k);
                let field = parameters.tr_mul(&row.rows(0, m)) + sizes.tr_mul(&row.rows(m, sizes.nrows()));
                squares += field.component_mul(&field);
            }
            expected += squares.iter().map(|q| (q * unit[s] * whole(s)).sqrt()).sum::<f64>();
            count += squares.len() as f64;
        }
        let expected2 = (expected / count.max(1.0) / MEAN_LENGTH).powi(2);
        let robot2 = (measured2 - noise2).max(0.05 * measured2);
        let (factor, white) = if expected2 > robot2 {
            ((robot2 / expected2.max(f64::MIN_POSITIVE)).sqrt(), 0.0)
        } else {
            (1.0, (robot2 - expected2).sqrt())
        };
        let left_out = MEAN_LENGTH * robot2.sqrt();
        Level {
            factor,
            white,
            left_out,
            spread: 0.05 + 0.42 / (super::recommend::postures(circumstances).count().max(1) as f64).sqrt(),
        }
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
