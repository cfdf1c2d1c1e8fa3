//! Projection orthogonal to a fitted model: the part of other columns that the model absorbs.

use nalgebra::{DMatrix, DVector};

use crate::identify::fit::{Fit, FitError};
use crate::identify::problem::Problem;
use crate::math::positive_definite::ScaledCholesky;

/// Information of the prior of a parameter beside rows that are times `weight` each.
pub(super) fn information(problem: &Problem, parameter: usize, weight: f64) -> f64 {
    // What is held against the noise of its own is in the unit of rows without weight.
    problem.information(parameter) * if problem.unit_variance() < 1.0 { weight * weight } else { 1.0 }
}

/// Separates the part of any vector that the fitted parameters absorb.
pub(crate) struct Projection {
    /// Cholesky factor L of the normal matrix of the fitted columns, scaled by S to a unit diagonal.
    pub factor: ScaledCholesky,
    /// `L^-1 S` times the inner products of the fitted columns with the candidates, and with the residuals.
    pub of_columns: DMatrix<f64>,
    pub of_residual: DVector<f64>,
}

impl Projection {
    /// The projection orthogonal to the fitted parameters, from the inner products of all rows with `candidates` columns, times
    /// `weight` each, and the squared residuals. The prior of a fitted parameter acts as a measurement of it: an extra row in which every
    /// candidate column is zero.
    pub fn of(
        products: &DMatrix<f64>,
        candidates: usize,
        weight: f64,
        problem: &Problem,
        fit: &Fit,
    ) -> Result<(Self, f64), FitError> {
        let n = candidates;
        let m = products.nrows() - n - 1;
        let mut normal = products.view((0, 0), (m, m)).into_owned();
        let mut gradient = products.view((0, m + n), (m, 1)).into_owned();
        let mut squares = products[(m + n, m + n)];
        for (k, p) in fit.kept.iter().enumerate() {
            let information = information(problem, *p, weight);
            normal[(k, k)] += information;
            gradient[k] -= information * fit.values[*p];
            squares += information * fit.values[*p].powi(2);
        }
        let factor = ScaledCholesky::of(&normal).map_err(|_| FitError::Singular)?;
        let empty = DMatrix::zeros(m, 0);
        let mut projection = Projection { factor, of_columns: empty, of_residual: DVector::zeros(m) };
        projection.of_columns = projection.half(products.view((0, m), (m, n)).into_owned());
        projection.of_residual = projection.half(gradient).column(0).into_owned();
        Ok((projection, squares))
    }

    /// Computes `L^-1 S x`, where x holds inner products with the fitted columns.
    pub fn half(&self, products: DMatrix<f64>) -> DMatrix<f64> {
        self.factor.half(products)
    }

    /// Computes `(J^T J)^-1 J^T x` from the result of [`half`](Self::half): the value of each fitted parameter that
    /// absorbs x, SI.
    pub fn absorbed(&self, half: DMatrix<f64>) -> DMatrix<f64> {
        self.factor.other_half(half)
    }

    /// Returns `R` with `R R^T = (J^T J)^-1`, which turns independent standard normal numbers into errors of the fitted
    /// parameters, SI.
    pub fn root_of_covariance(&self) -> DMatrix<f64> {
        let n = self.of_residual.len();
        self.absorbed(DMatrix::identity(n, n))
    }
}
