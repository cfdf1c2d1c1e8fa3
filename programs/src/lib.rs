//! Robot programs, whose positions are compensated in their places: everything else stays byte for byte.
//!
//! # Features
//!
//! * `schema`: the JSON Schema of a file of frames. Off by default.

mod configuration;
mod dialects;
mod flow;
mod frames;
mod frames_file;
mod layout;
mod numbers;
mod program;
mod read_back;
mod rewrite;
mod rewritten;
mod scan;
mod stretches;
mod world;

#[cfg(feature = "schema")]
pub use frames_file::frames_schema;
pub use frames_file::{FARTHEST_BASE_MM, FRAMES_FORMAT, LONGEST_TOOL_MM, NamedFrames, read_frames};
pub use program::{Dialect, Program, read_program};
pub use rewrite::{Permissions, rewrite_programs};
pub use rewritten::{Rewritten, RewrittenProgram};
pub use scan::Remark;
