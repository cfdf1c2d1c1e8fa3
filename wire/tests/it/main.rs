//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_controller_that_cannot_be_used_is_named;
mod the_manufacturers_bytes_are_ours;
