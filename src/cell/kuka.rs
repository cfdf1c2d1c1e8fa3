//! KUKA robots through the variable server on their controller.
//!
//! The server (KUKAVARPROXY, C3 Bridge) reads and writes KRL variables; a program on the controller ([`calibench_wire::kuka::program_files`]) moves
//! the arm accordingly.

mod driver;
mod geometry;
mod keys;
mod link;
mod order;
mod robot;
mod settings;

pub use geometry::{e6axis, frame_of, joints_of, krl_frame};
pub(crate) use keys::KukaKeys;
pub use link::{Link, LinkError};
pub use robot::{KukaRobot, KukaState};
pub use settings::{Actions, Fitness, KukaSettings, RobotProgram, Variables};
