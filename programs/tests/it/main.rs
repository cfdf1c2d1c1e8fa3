//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_program_is_rewritten_and_nothing_else;
#[path = "../../../tests/it/identified.rs"]
mod identified;
mod programs_are_as_controllers_write_them;
