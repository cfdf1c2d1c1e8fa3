//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_run_is_replayed;
mod the_viewer_is_pinned;
mod what_is_not_there_is_left_out;
