//! Universal Robots through real-time data exchange (RTDE) and a program on their controller.
//!
//! RTDE reads the arm's state and carries the orders; the program ([`calibench_wire::ur::PROGRAM`]), which the driver sends to
//! the controller's script interface, carries them out.

mod driver;
mod keys;
mod link;
mod robot;
mod settings;

pub(crate) use keys::UrKeys;
pub use link::UrError;
pub use robot::{UrRobot, numbers_of, pose_of};
pub use settings::{UrMotion, UrPayload, UrSettings, UrTorques};
