//! Significance level of all tests of a comparison.

/// Level of the tests for findings, lack of fit and views, for each kind separately.
pub const SIGNIFICANCE: f64 = 0.01;
