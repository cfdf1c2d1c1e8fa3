//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_moving_arm_is_measured;
mod a_row_holds_the_pose_of_one_tag;
mod moving_arm;
mod two_clocks_are_matched_or_refused;
