//! Judging a calibration: position errors on poses that it has not seen, and where it fails.

mod comparison;
mod noise_floor;
mod residual_views;
mod validation;

pub use comparison::{Comparison, Finding, LackOfFit, SIGNIFICANCE, Standing, Subject};
pub use noise_floor::{CONFIDENCE, NoiseFloor, NoiseLevel, NoiseSource, Replicates};
pub use residual_views::{
    BallView, JointBin, JointCurve, JointOffset, JointVariable, SampleResidual, SetupView, ToolView, ViewTest, WorldView,
    WorstSample,
};
pub use validation::{HistogramBin, Validation};
