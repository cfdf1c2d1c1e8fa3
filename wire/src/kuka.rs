//! KUKA's variable servers: frames on the wire, values as text, and the program that moves the arm.

mod frame;
mod program;
mod value;

pub use frame::{Call, FrameError, FrameReader, LONGEST_FRAME, Request, Response};
pub use program::{PROGRAM_NAME, Verdict, program_files};
pub use value::{Structure, Value, ValueError};
