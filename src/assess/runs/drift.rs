//! The size of a drift: the variance of the steps that a parameter makes from run to run, in proportion to the time between them.

use nalgebra::{DMatrix, DVector};

use super::products::Reduced;

/// Twice the log likelihood ratio at the one-sided limit of 95 %.
const LIMIT: f64 = 2.706;

/// Sizes tried, in units of the smallest that could be seen: from nothing to gross, in steps of a twelfth of a decade.
const STEPS: usize = 97;
const A_DECADE: f64 = 12.0;

/// A drift as a random walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// One sigma of the change in a month, SI: the most likely one.
    pub monthly: f64,
    /// It is smaller than this at a level of 95 %.
    pub at_most: f64,
}

impl Drift {
    /// Estimates the drift of one column by the restricted likelihood, with residuals of the variance `unit`; `None` if the runs show nothing of it.
    pub(super) fn of(reduced: &Reduced, unit: f64, column: usize, months: &[f64]) -> Option<Drift> {
        let (gram, along) = reduced.increments(column);
        let root = DVector::from_iterator(gram.nrows(), months.windows(2).map(|w| (w[1] - w[0]).max(0.0).sqrt()));
        let scaled = DMatrix::from_fn(gram.nrows(), gram.ncols(), |r, c| root[r] * gram[(r, c)] * root[c] / unit);
        let eigen = scaled.symmetric_eigen();
        let seen = eigen.eigenvectors.tr_mul(&along.component_mul(&root)) / unit.sqrt();
        let most = eigen.eigenvalues.max();
        if most.is_nan() || most <= 0.0 {
            return None;
        }
        let smallest = 0.01 / most.sqrt();
        let likelihood = |size: f64| -> f64 {
            let q = size * size;
            let of = |(l, u): (&f64, &f64)| {
                let spread = 1.0 + q * l.max(0.0);
                0.5 * (q * u * u / spread - spread.ln())
            };
            eigen.eigenvalues.iter().zip(&seen).map(of).sum()
        };
        let sizes: Vec<f64> =
            std::iter::once(0.0).chain((0..STEPS).map(|k| smallest * 10f64.powf(k as f64 / A_DECADE))).collect();
        let all: Vec<f64> = sizes.iter().map(|size| likelihood(*size)).collect();
        let best = (0..sizes.len()).max_by(|&a, &b| all[a].total_cmp(&all[b])).unwrap_or(0);
        let beyond = (best..sizes.len()).find(|&k| 2.0 * (all[best] - all[k]) > LIMIT);
        Some(Drift { monthly: sizes[best], at_most: beyond.map_or(f64::INFINITY, |k| sizes[k]) })
    }
}
