//! Size of each band of every joint's error curve, by maximum evidence: one variance per band, with a weak prior about
//! their common size.
//!
//! Hundreds of columns do no harm if shrunk in this way, whereas a few selected ones do. A band that the data do not
//! determine takes the size of the others, limited by a cap: without it, a wide band oscillates in the gaps of the
//! data.

use nalgebra::{DMatrix, DVector};

use crate::diagnosis::examination::Span;
use crate::identify::fit::FitError;
use crate::math::linalg;

/// Number of iterations.
const ROUNDS: usize = 10;

/// Weight of the common size, in coefficients.
const PRIOR_WEIGHT: f64 = 4.0;

/// Largest variance of a band, in plausible sizes squared (twice the plausible size, decision 0025).
const CAP: f64 = 4.0;

/// Variances of the groups, and the noise estimated with them.
#[derive(Debug, Clone)]
pub(super) struct Shrinkage {
    /// Variance of each group's coefficients, in plausible sizes squared.
    pub variance: Vec<f64>,
    /// Remaining variance of the whitened residuals.
    pub noise: f64,
}

impl Shrinkage {
    /// Estimates the sizes from the inner products `[X r]^T [X r]` of base columns, groups (spans among the columns)
    /// and residuals; `information` is the prior information of the base.
    pub fn new(
        products: &DMatrix<f64>,
        base: usize,
        information: &[f64],
        groups: &[Span],
        rows: usize,
    ) -> Result<Self, FitError> {
        let total = products.nrows() - 1;
        let mut variance = vec![1.0; groups.len()];
        let squares = products[(total, total)];
        let mut noise = squares / (rows as f64 - base as f64).max(1.0);
        let scale = DVector::from_fn(total, |k, _| {
            1.0 / (products[(k, k)] + information.get(k).copied().unwrap_or(0.0)).max(1e-300).sqrt()
        });
        let mut factor = linalg::Cholesky::new(total);
        let mut inverse = DMatrix::zeros(total, total);
        for _ in 0..ROUNDS {
            let mut diagonal: Vec<f64> =
                (0..total).map(|k| information.get(k).copied().unwrap_or(0.0) / noise.max(f64::MIN_POSITIVE)).collect();
            for (span, v) in groups.iter().zip(&variance) {
                span.range().for_each(|k| diagonal[k] = 1.0 / v);
            }
            let mut normal = DMatrix::from_fn(total, total, |r, c| products[(r, c)] * scale[r] * scale[c] / noise);
            (0..total).for_each(|k| normal[(k, k)] += diagonal[k] * scale[k] * scale[k] + 1e-12 / noise);
            factor.factor(&normal)?;
            factor.inverse(&mut inverse);
            let gradient = DVector::from_fn(total, |k, _| products[(k, total)] * scale[k] / noise);
            let scaled = &inverse * gradient;
            let mean = scaled.component_mul(&scale);
            let covariance = |k: usize| inverse[(k, k)] * scale[k] * scale[k];
            let common = (variance.iter().map(|v| v.ln()).sum::<f64>() / variance.len().max(1) as f64).exp().min(1.0);
            let explained = 2.0 * (0..total).map(|k| mean[k] * products[(k, total)]).sum::<f64>() - quadratic(products, &mean);
            let effective: f64 = total as f64 - (0..total).map(|k| covariance(k) * diagonal[k]).sum::<f64>();
            for (span, v) in groups.iter().zip(&mut variance) {
                let sum: f64 = span.range().map(|k| mean[k].powi(2) + covariance(k)).sum();
                *v = ((sum + PRIOR_WEIGHT * common) / (span.count as f64 + PRIOR_WEIGHT)).clamp(1e-6, CAP);
            }
            noise = (squares - explained).max(1e-6 * squares) / (rows as f64 - effective).max(1.0);
        }
        Ok(Shrinkage { variance, noise })
    }
}

fn quadratic(products: &DMatrix<f64>, x: &DVector<f64>) -> f64 {
    let n = x.len();
    (0..n).map(|c| x[c] * products.column(c).rows(0, n).dot(x)).sum()
}
