//! Normal equations of the columns that all hypotheses about runs share, and their solution.

use nalgebra::{DMatrix, DVector};

use crate::identify::calibration::IdentifyError;
use crate::identify::fit::FitError;
use crate::math::positive_definite::ScaledCholesky;

/// A column in the runs from one on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub column: usize,
    pub from: usize,
}

impl Part {
    pub fn everywhere(column: usize) -> Part {
        Part { column, from: 0 }
    }

    pub fn weight(self, run: usize) -> f64 {
        if run >= self.from { 1.0 } else { 0.0 }
    }
}

pub(super) struct Base {
    pub parts: Vec<Part>,
    pub normal: DMatrix<f64>,
    pub gradient: DVector<f64>,
    pub squares: f64,
}

/// Added to the scaled diagonal: a parameter that no run determines stays at its prior. A hundred times the rounding of a sum of
/// a thousand products of numbers near one.
const RIDGE: f64 = 1e-13;

/// The base solved for.
pub(super) struct Solved {
    pub factor: ScaledCholesky,
    pub solution: DVector<f64>,
    pub inverse: DMatrix<f64>,
    /// Sum of squares left, priors included.
    pub squares: f64,
}

impl Solved {
    pub fn new(base: &Base, information: Vec<f64>, pull: &DVector<f64>) -> Result<Solved, IdentifyError> {
        let n = base.normal.nrows();
        let scale = |k: usize| (base.normal[(k, k)] + information[k]).max(1e-300).powf(-0.5);
        let mut factor = ScaledCholesky::new(n);
        factor
            .factor(scale, |r, c| base.normal[(r, c)], |k, scale| information[k] * scale * scale + RIDGE)
            .map_err(FitError::from)?;
        let inverse = factor.inverse();
        let gradient = &base.gradient + pull;
        let solution = &inverse * &gradient;
        // The priors, as measurements, have their own residuals at the fit: pull² / information.
        let of_priors = pull.iter().zip(&information).filter(|(_, i)| **i > 0.0).map(|(p, i)| p * p / i).sum::<f64>();
        let squares = (base.squares + of_priors - solution.dot(&gradient)).max(f64::MIN_POSITIVE);
        Ok(Solved { factor, solution, inverse, squares })
    }
}
