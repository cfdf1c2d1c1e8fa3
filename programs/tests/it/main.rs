//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_dense_path_stays_smooth;
mod a_program_is_rewritten_and_nothing_else;
mod elements_of_arrays_are_told_apart;
mod every_dialect_branches_and_calls;
mod every_frame_is_taken_or_told;
mod frames_come_from_files;
#[path = "../../../tests/it/identified.rs"]
mod identified;
mod jobs_of_yaskawa_and_of_staubli;
mod programs_are_as_controllers_write_them;
