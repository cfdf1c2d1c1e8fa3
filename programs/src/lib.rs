//! Robot programs, whose positions are compensated in their places: everything else stays byte for byte.

mod configuration;
mod dialects;
mod flow;
mod frames;
mod frames_file;
mod numbers;
mod program;
mod rewrite;
mod scan;

pub use frames_file::{NamedFrames, read_frames};
pub use program::{Dialect, Program, read_program};
pub use rewrite::{Permissions, Rewritten, RewrittenProgram, rewrite_programs};
pub use scan::Remark;
