//! KUKA robots through the variable server on their controller.

mod frame;
mod geometry;
mod value;

pub use frame::{Call, FrameError, FrameReader, LONGEST_FRAME, Request, Response};
pub use geometry::{e6axis, frame_of, joints_of, krl_frame};
pub use value::{Structure, Value, ValueError};
