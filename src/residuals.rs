//! Residuals: the position errors of a calibration at poses that it was or was not fitted to, from every side, and the noise in them.
//!
//! [`Validation`] judges unseen rows, [`comparison`] the lack of fit against the noise floor, [`views`] the residuals by
//! ball, tool, base and joint, [`noise`] their scatter, and [`misfit`] whether the data fit their robot at all.

pub mod comparison;
mod look;
mod lost_motion;
pub mod misfit;
pub mod noise;
pub mod noise_floor;
mod repeatability;
mod validation;
pub mod views;

pub use look::Look;
pub use lost_motion::{Arrivals, LostMotion};
pub use noise_floor::{noise_left, unexplained};
pub use repeatability::{PoseRepeatability, Repeatability, StationRepeatability};
pub use validation::{HistogramBin, OrientationErrors, Validation};
