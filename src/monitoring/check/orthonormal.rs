//! Orthonormal columns, for conditions whose parameters are of different units.

use nalgebra::DMatrix;

/// Directions of a condition that displace the samples by less than this share of the largest are not seen.
const SEEN: f64 = 1e-6;

/// Orthonormal columns that span those of a matrix.
pub(super) fn orthonormal(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    // Parameters of different units are made alike first.
    if matrix.is_empty() {
        return DMatrix::zeros(matrix.nrows(), 0);
    }
    let mut scaled = matrix.clone();
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    let svd = scaled.svd(true, false);
    let largest = svd.singular_values.max();
    let rank = svd.singular_values.iter().filter(|s| **s > SEEN * largest && **s > 0.0).count();
    svd.u.map_or_else(
        || DMatrix::zeros(matrix.nrows(), 0),
        |u| {
            // Singular values are in descending order.
            u.columns(0, rank).into_owned()
        },
    )
}
