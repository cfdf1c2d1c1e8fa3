//! At the poses that a MuJoCo run reports for the true arm, the ball was within the gauge.

use std::path::Path;

use calibench_sim::scenario::{PlantKind, load_scenario};

use crate::true_arm::holds_the_ball;

#[test]
fn on_mujoco() {
    let table8 = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/table8.toml");
    let mut scenario = load_scenario(&table8).unwrap().with_plant(PlantKind::Mujoco);
    scenario.mujoco = Some(calibench_mujoco::make_plant);
    holds_the_ball(&scenario);
}
