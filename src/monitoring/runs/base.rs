//! Normal equations of the columns that all hypotheses about runs share, and their solution.

use nalgebra::{DMatrix, DVector};

use crate::identify::calibration::IdentifyError;
use crate::identify::fit::FitError;
use crate::math::linalg::Cholesky;

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

/// The base solved for.
pub(super) struct Solved {
    pub factor: Cholesky,
    pub scale: Vec<f64>,
    pub solution: DVector<f64>,
    pub inverse: DMatrix<f64>,
    /// Sum of squares left, priors included.
    pub squares: f64,
}

impl Solved {
    pub fn new(base: &Base, information: Vec<f64>, pull: &DVector<f64>) -> Result<Solved, IdentifyError> {
        let n = base.normal.nrows();
        let scale: Vec<f64> = (0..n).map(|k| (base.normal[(k, k)] + information[k]).max(1e-300).powf(-0.5)).collect();
        let mut normal = DMatrix::from_fn(n, n, |r, c| base.normal[(r, c)] * scale[r] * scale[c]);
        (0..n).for_each(|k| normal[(k, k)] += information[k] * scale[k] * scale[k] + 1e-13);
        let mut factor = Cholesky::new(n);
        factor.factor(&normal).map_err(FitError::from)?;
        let mut inverse = DMatrix::zeros(n, n);
        factor.inverse(&mut inverse);
        for c in 0..n {
            for r in 0..n {
                inverse[(r, c)] *= scale[r] * scale[c];
            }
        }
        let gradient = &base.gradient + pull;
        let solution = &inverse * &gradient;
        // The priors, as measurements, have their own residuals at the fit: pull² / information.
        let of_priors = pull.iter().zip(&information).filter(|(_, i)| **i > 0.0).map(|(p, i)| p * p / i).sum::<f64>();
        let squares = (base.squares + of_priors - solution.dot(&gradient)).max(f64::MIN_POSITIVE);
        Ok(Solved { factor, scale, solution, inverse, squares })
    }
}
