//! The promises of this package, one file each.
#![allow(clippy::unwrap_used)] // a test fails by panicking

mod an_exported_arm_is_the_same_in_mujoco;
#[path = "../../../../tests/it/golden.rs"]
mod golden;
mod mujoco_agrees_with_the_closed_forms;
mod mujoco_flaws_are_as_large_as_said;
mod mujoco_flaws_are_found_blind;
mod mujoco_sees_no_motion_touch;
mod mujoco_starts;
#[path = "../../../../tests/it/oracles.rs"]
mod oracles;
#[path = "../../../tests/it/planned.rs"]
mod planned;
mod the_true_arm_holds_the_ball_in_mujoco;
#[path = "../../../tests/it/true_arm.rs"]
mod true_arm;
