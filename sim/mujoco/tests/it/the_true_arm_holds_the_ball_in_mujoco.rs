//! At the poses that a MuJoCo run reports for the true arm, the ball was within the gauge.

use std::path::Path;

use calibench_sim::scenario::PlantKind;

use crate::true_arm::holds_the_ball;

#[test]
fn on_mujoco() {
    calibench_mujoco::provide();
    holds_the_ball(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios"), PlantKind::Mujoco);
}
