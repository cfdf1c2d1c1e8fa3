//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod two_clocks_are_matched_or_refused;
