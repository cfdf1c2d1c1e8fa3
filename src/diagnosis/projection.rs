//! Projection orthogonal to a fitted model: the part of other columns that the model absorbs.

use nalgebra::{DMatrix, DVector};

use crate::math::positive_definite::ScaledCholesky;

/// Separates the part of any vector that the fitted parameters absorb.
pub(crate) struct Projection {
    /// Cholesky factor L of the normal matrix of the fitted columns, scaled by S to a unit diagonal.
    pub factor: ScaledCholesky,
    /// `L^-1 S` times the inner products of the fitted columns with the candidates, and with the residuals.
    pub of_columns: DMatrix<f64>,
    pub of_residual: DVector<f64>,
}

impl Projection {
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
