//! Robot programs, whose positions are compensated in their places: everything else stays byte for byte.

mod configuration;
mod fanuc;
mod krl;
mod numbers;
mod program;
mod rapid;
mod rewrite;
mod scan;
mod urscript;

pub use program::{Dialect, Program, read_program};
pub use rewrite::{Permissions, Rewritten, RewrittenProgram, rewrite_programs};
pub use scan::Remark;
