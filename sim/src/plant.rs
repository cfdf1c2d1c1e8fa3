//! The mechanics of a cell: the rest positions of arm, balls and plungers for given motor angles.
//!
//! Everything else is the same for every plant: the robot's controller, the counters of the indicators, the clock, the tracker.

mod analytic;
mod arm;
mod parts;

pub use analytic::AnalyticPlant;

use crate::mechanics::{Parts, Plant, PlantError};
use crate::random::Streams;
use crate::scenario::{PlantKind, Scenario};

/// Builds the plant requested by a scenario, for a session of about `session_s` seconds.
///
/// # Errors
/// When that plant cannot simulate the scenario, or is not available.
pub fn plant(scenario: &Scenario, streams: &Streams, parts: &Parts, session_s: f64) -> Result<Box<dyn Plant>, PlantError> {
    match scenario.plant {
        PlantKind::Analytic if scenario.truth().keys().mujoco.is_empty() => {
            let flaws = scenario.truth().flaws(streams, parts.robot.joints());
            Ok(Box::new(AnalyticPlant::new(parts, flaws, session_s)))
        }
        PlantKind::Analytic => Err(PlantError::Unsuited {
            key: "truth.mujoco".into(),
            problem: "can be simulated by the MuJoCo plant alone".into(),
            remedy: "run it with --plant mujoco, or write plant = \"mujoco\"".into(),
        }),
        PlantKind::Mujoco => mujoco(scenario, streams, parts),
    }
}

fn mujoco(scenario: &Scenario, streams: &Streams, parts: &Parts) -> Result<Box<dyn Plant>, PlantError> {
    let absent = || PlantError::Absent {
        plant: "mujoco",
        reason: "this program was built without it; run sim/setup.sh, then build with --features mujoco".into(),
    };
    scenario.mujoco.ok_or_else(absent)?(scenario, streams, parts)
}
