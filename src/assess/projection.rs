//! What a fitted model absorbs of anything laid beside it.

use nalgebra::{DMatrix, DVector};

use crate::math::linalg;

/// Takes out of any vector what the fitted parameters absorb.
pub(super) struct Projection {
    /// Of the normal matrix of the fitted columns, scaled to a unit diagonal.
    pub factor: linalg::Cholesky,
    /// One over the root of that diagonal.
    pub scale: DVector<f64>,
    /// `L^-1` times the inner products of the fitted columns with the candidates, and with the residuals.
    pub of_columns: DMatrix<f64>,
    pub of_residual: DVector<f64>,
}

impl Projection {
    /// `L^-1 S x` of inner products with the fitted columns.
    pub fn half(&self, mut products: DMatrix<f64>) -> DMatrix<f64> {
        for (mut row, scale) in products.row_iter_mut().zip(&self.scale) {
            row *= *scale;
        }
        self.factor.whiten(&mut products);
        products
    }

    /// `(J^T J)^-1 J^T x` of such a half: how much of each fitted parameter absorbs x, SI.
    pub fn absorbed(&self, mut half: DMatrix<f64>) -> DMatrix<f64> {
        self.factor.unwhiten(&mut half);
        for (mut row, scale) in half.row_iter_mut().zip(&self.scale) {
            row *= *scale;
        }
        half
    }

    /// `S` with `S S^T = (J^T J)^-1`: turns independent unit normal numbers into fitted parameters' errors, SI.
    pub fn root_of_covariance(&self) -> DMatrix<f64> {
        let n = self.scale.len();
        self.absorbed(DMatrix::identity(n, n))
    }
}
