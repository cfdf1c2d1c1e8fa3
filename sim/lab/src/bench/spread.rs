//! Quantiles of values.

use crate::suite::quantile;

/// The 2.5 and 97.5 % points of values.
pub(super) fn percentiles(values: &[f64]) -> [f64; 2] {
    [0.025, 0.975].map(|share| quantile(values.to_vec(), share))
}

/// The median; `None` of nothing.
pub(super) fn median(values: Vec<f64>) -> Option<f64> {
    (!values.is_empty()).then(|| quantile(values, 0.5))
}
