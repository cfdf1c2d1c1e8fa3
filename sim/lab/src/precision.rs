//! The precision test of the TriCal (paper Table 3): distance of a centred datum ball from the position of the master ball, as
//! measured by a coordinate measuring machine, and its error budget.

mod bench;
mod budget;
mod procedure;
mod setup;
mod source;
mod text;
mod views;

use calibench::cell::ManipulatorError;
use calibench::measure::campaign::mastering::MasteringError;
use calibench::measure::centring::CentringFailure;
use thiserror::Error;

pub use budget::{Budget, Contribution, Largest, RootMeanSquare, budget};
pub use procedure::{PrecisionTest, Repetition, carry_out};
pub use setup::{ArmSpec, Setup};
pub use source::{Source, Sources};
pub use text::{precision_json, precision_text};

/// Largest distance between datum ball and master ball in the paper, um: "about 2 um" (section 4). It prints nothing else of
/// that test.
pub const PAPER_LARGEST_UM: f64 = 2.0;

/// Expected range of the largest deviation of a test, um: "about 2 um" to within its last printed digit, and half as much again
/// for the randomness of one draw.
pub const EXPECTED_UM: [f64; 2] = [1.5, 3.0];

/// Error of a precision test.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum PrecisionError {
    /// The indicators could not be mastered.
    #[error("the indicators cannot be mastered")]
    Mastering(#[from] MasteringError),
    /// The small arm did not move the ball into the gauge.
    #[error("the small arm does not carry the datum ball into the gauge")]
    Arm(#[from] ManipulatorError),
    /// The datum ball could not be centred.
    #[error("the datum ball cannot be centred, repetition {}", repetition + 1)]
    Centring {
        /// Index of the repetition, from 0.
        repetition: usize,
        /// Cause of the failure.
        #[source]
        failure: CentringFailure,
    },
}
