//! Judging a calibration: position errors on poses that it has not seen.

mod validation;

pub use validation::{HistogramBin, Validation};
