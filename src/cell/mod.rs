//! What stands in the cell, behind traits: the robot, the indicators, the artifact, the TriCal.
//!
//! Goal: the controller that centres a real robot is the one that centres the simulated one. Non-goals: opening, addressing
//! and configuring devices, which belong to the implementation.

mod indicator;
mod later_clock;
mod manipulator;
mod recorded_stops;
mod replay;
pub mod scripted;
mod trical;

pub use indicator::{Indicator, IndicatorError};
pub use later_clock::LaterClock;
pub use manipulator::{Manipulator, ManipulatorError};
pub use replay::{Recording, ReplayDeparture, ReplayedIndicator, ReplayedRobot};
pub use trical::TriCal;
