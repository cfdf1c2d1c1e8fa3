//! The level of all tests of a comparison.

/// Findings, lack of fit and views are judged at this level, each kind for itself.
pub const SIGNIFICANCE: f64 = 0.01;
