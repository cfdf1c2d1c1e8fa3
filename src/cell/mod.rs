//! What stands in the cell, behind traits: the robot, the indicators, the artifact, the TriCal.
//!
//! Goal: the controller that centres a real robot is the one that centres the simulated one. The traits know nothing of opening,
//! addressing and configuring devices; their drivers ([`gauge`], [`kuka`]) do.

pub mod gauge;
mod guarded;
mod guards;
mod indicator;
pub mod kuka;
mod later_clock;
mod manipulator;
mod recorded_stops;
mod replay;
pub mod scripted;
mod socket;
mod stop_request;
mod trical;

pub use guarded::{Guarded, Motion, MotionRecord};
pub use guards::{Forbidden, Guards};
pub use indicator::{Indicator, IndicatorError};
pub use later_clock::LaterClock;
pub use manipulator::{Manipulator, ManipulatorError};
pub use replay::{Recording, ReplayDeparture, ReplayedIndicator, ReplayedRobot};
pub use stop_request::StopRequest;
pub use trical::TriCal;
