//! The effect of each parameter on every sample, under given loads.

use super::jacobian_pattern::JacobianPattern;

/// Weights of the parameters that move one sample.
#[derive(Debug, Clone, Default)]
pub(super) struct RowTerms {
    /// Index of its pattern of moves: most samples are moved by the same parameters at the same sites.
    pub pattern: usize,
    /// Weight of each parameter of the pattern.
    pub weights: Vec<f64>,
}

impl RowTerms {
    /// Calls `add(place, by)` for every site that deviates when the parameters have these `values`.
    #[inline]
    pub fn deviate(&self, pattern: &[JacobianPattern], values: &[f64], mut add: impl FnMut(usize, f64)) {
        for (moves, weight) in pattern.iter().zip(&self.weights) {
            let value = values[moves.parameter];
            // All are zero at the start of a fit, and undetermined ones always.
            if value != 0.0 {
                add(moves.place, weight * value);
            }
        }
    }
}

/// Weights of the parameters for every sample, each under the loads of its posture.
#[derive(Debug, Clone, Default)]
pub(in crate::identify) struct LoadState {
    /// Compliance of each joint, rad/(N·m).
    pub(super) compliance: Vec<f64>,
    pub(super) patterns: Vec<Vec<JacobianPattern>>,
    pub(super) rows: Vec<RowTerms>,
}

impl LoadState {
    /// For evaluating at `values` the rows from `first` on.
    pub(super) fn deviating<'a>(&'a self, values: &'a [f64], first: usize) -> Deviating<'a> {
        Deviating { values, patterns: &self.patterns, terms: &self.rows[first..] }
    }
}

/// Deviations of the arm caused by the parameters, for some rows.
#[derive(Clone, Copy)]
pub(super) struct Deviating<'a> {
    /// Values of the parameters, SI.
    pub values: &'a [f64],
    pub patterns: &'a [Vec<JacobianPattern>],
    /// At least one per row.
    pub terms: &'a [RowTerms],
}
