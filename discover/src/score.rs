//! The evidence for columns: how much better they explain a series than nothing does.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// A column of which the ground leaves less than this share is not seen.
const SEEN: f64 = 1e-3;

/// Inner products of a candidate's columns in one metric.
pub(crate) struct Products {
    factor: Cholesky<f64, Dyn>,
    scales: DVector<f64>,
}

impl Products {
    /// `gram` of the columns, whose squared lengths before projection are `whole`; `None` if one is not seen, or if they are dependent.
    pub fn of(gram: &DMatrix<f64>, whole: &[f64]) -> Option<Self> {
        let k = gram.nrows();
        if (0..k).any(|i| !(gram[(i, i)] > SEEN * whole[i])) {
            return None;
        }
        let scales = DVector::from_fn(k, |i, _| gram[(i, i)].sqrt().recip());
        let scaled = DMatrix::from_fn(k, k, |i, j| gram[(i, j)] * scales[i] * scales[j]);
        let factor = Cholesky::new(scaled)?;
        // A column must not be nearly the sum of the others.
        (0..k).all(|i| factor.l_dirty()[(i, i)].powi(2) > SEEN).then_some(Products { factor, scales })
    }

    /// Square of what the columns explain of a series, given their products with it.
    pub fn explained(&self, with: &[f64]) -> f64 {
        let mut half = DVector::from_fn(with.len(), |i, _| with[i] * self.scales[i]);
        self.factor.l_dirty().solve_lower_triangular_unchecked_mut(&mut half);
        half.norm_squared()
    }

    /// Coefficients of the columns that explain a series best.
    pub fn coefficients(&self, with: &[f64]) -> DVector<f64> {
        let scaled = DVector::from_fn(with.len(), |i, _| with[i] * self.scales[i]);
        self.factor.solve(&scaled).component_mul(&self.scales)
    }
}

/// Log evidence of `columns` columns that explain the share `r2` of a series of `dof` degrees of freedom over no columns, by Zellner's
/// prior with the information of one residual.
pub(crate) fn ln_evidence(r2: f64, columns: usize, dof: f64) -> f64 {
    let g = dof;
    let rest = (1.0 - r2).max(1e-12);
    0.5 * (dof - columns as f64) * g.ln_1p() - 0.5 * dof * (g * rest).ln_1p()
}

/// The share of a series that `columns` columns have to explain for a log evidence of `wanted`.
pub(crate) fn share_for(wanted: f64, columns: usize, dof: f64) -> f64 {
    let g = dof;
    let ln = (0.5 * (dof - columns as f64) * g.ln_1p() - wanted) / (0.5 * dof);
    1.0 - ln.exp_m1() / g
}

/// `ln(sum(exp))`.
pub(crate) fn ln_sum_exp(values: &[f64]) -> f64 {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if largest.is_finite() { largest + values.iter().map(|v| (v - largest).exp()).sum::<f64>().ln() } else { largest }
}
