//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_sweep_reaches_every_key;
mod diagnosis_is_right_in_blind_trials;
