//! The precision test of the TriCal (paper Table 3): how far a centred datum ball stands from where the master ball stood, as a
//! coordinate measuring machine sees it, and what that distance is made of.

mod bench;
mod budget;
mod procedure;
mod setup;
mod source;
mod views;

use calibench::cell::ManipulatorError;
use calibench::measure::{CentringFailure, MasteringError};
use thiserror::Error;

pub use budget::{Budget, Contribution, Largest, RootMeanSquare, budget};
pub use procedure::{PrecisionTest, Repetition, carry_out};
pub use setup::{ArmSpec, Setup};
pub use source::{Source, Sources};

/// What the paper saw at most between datum ball and master ball, um: "about 2 um" (section 4). It prints nothing else of that test.
pub const PAPER_LARGEST_UM: f64 = 2.0;

/// Where the largest deviation of a test is expected, um: "about 2 um" is two to the last digit printed, and half as much again for the
/// luck of one draw.
pub const EXPECTED_UM: [f64; 2] = [1.5, 3.0];

/// Why a precision test came to no end.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum PrecisionError {
    /// The indicators could not be mastered.
    #[error("the indicators cannot be mastered")]
    Mastering(#[from] MasteringError),
    /// The small arm did not carry the ball into the gauge.
    #[error("the small arm does not carry the datum ball into the gauge")]
    Arm(#[from] ManipulatorError),
    /// The datum ball could not be centred.
    #[error("the datum ball cannot be centred, repetition {}", repetition + 1)]
    Centring {
        /// Which repetition, from 0.
        repetition: usize,
        /// What ended it.
        #[source]
        failure: CentringFailure,
    },
}
