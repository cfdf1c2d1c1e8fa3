//! The devices of the cell behind traits: the robot, the indicators, the artifact, the TriCal.
//!
//! Goal: the code that centres a real robot is the same that centres the simulated one. The traits do not cover opening,
//! addressing and configuring devices; their drivers ([`gauge`], [`kuka`], [`ur`]) do.

pub mod cell_reading;
mod driver;
pub mod gauge;
mod guarded;
pub mod guards;
mod guards_keys;
mod indicator;
pub mod kuka;
mod manipulator;
mod offset_clock;
pub mod patience;
mod recorded_stops;
pub mod replay;
mod robot_settings;
pub mod scripted;
mod socket;
mod stop_request;
mod trical;
pub mod ur;

pub(crate) use cell_reading::CellReading;
pub use driver::{ControllerFrames, ControllerState, Driver, DriverError};
pub(crate) use guards_keys::{GuardsKeys, TriCalKeys};
pub use indicator::{Indicator, IndicatorError};
pub use manipulator::{Manipulator, ManipulatorError};
pub(crate) use robot_settings::RobotKeys;
pub use robot_settings::{RobotKind, RobotSettings};
pub use stop_request::StopRequest;
pub use trical::TriCal;
