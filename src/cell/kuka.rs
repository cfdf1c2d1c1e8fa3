//! KUKA robots through the variable server on their controller.
//!
//! The server (KUKAVARPROXY, C3 Bridge) reads and writes KRL variables; a program on the controller ([`program_files`]) moves
//! the arm accordingly.

mod driver;
mod frame;
mod geometry;
mod keys;
mod link;
mod order;
mod program;
mod robot;
mod settings;
mod value;

pub use frame::{Call, FrameError, FrameReader, LONGEST_FRAME, Request, Response};
pub use geometry::{e6axis, frame_of, joints_of, krl_frame};
pub(crate) use keys::KukaKeys;
pub use link::LinkError;
pub use program::{PROGRAM_NAME, Verdict, program_files};
pub use robot::{KukaRobot, KukaState};
pub use settings::{Actions, Fitness, KukaSettings, Patience, RobotProgram, Variables};
pub use value::{Structure, Value, ValueError};
