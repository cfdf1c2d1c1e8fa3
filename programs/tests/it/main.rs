//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_program_is_rewritten_and_nothing_else;
mod frames_come_from_files;
#[path = "../../../tests/it/identified.rs"]
mod identified;
mod programs_are_as_controllers_write_them;
