//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_step_is_reported_where_it_happened;
mod classes_of_errors_are_told_apart;
#[path = "../../../tests/it/effect_cell.rs"]
mod effect_cell;
mod figures_have_one_name;
mod file_formats_are_written_down;
mod format_page;
mod schemas_are_written_down;
