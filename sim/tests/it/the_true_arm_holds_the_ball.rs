//! At the postures that a run reports for the true arm, the ball was within the gauge: at every stop with readings its
//! distance from the TCP agrees with them, and the links are connected.

use std::path::Path;

use calibench_sim::scenario::{PlantKind, load_scenario};

use crate::true_arm::holds_the_ball;

#[test]
fn on_the_closed_forms() {
    let table8 = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/table8.toml");
    holds_the_ball(&load_scenario(&table8).unwrap().with_plant(PlantKind::Analytic));
}
