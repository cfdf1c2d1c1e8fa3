//! The simulated cell in MuJoCo, run through an embedded Python: an independent physics engine that shares no code with
//! the model.

mod element;
mod engine;
mod flaws;
mod machine;
mod mjcf;
mod picture;
mod plant;
mod python;
mod scenery;

use calibench_sim::mechanics::{Parts, Plant, PlantError};
use calibench_sim::random::Streams;
use calibench_sim::scenario::Scenario;

pub use engine::{Engine, Field, Thing};
pub use flaws::MujocoFlaws;
pub use machine::machine;
pub use mjcf::Machine;
pub use picture::{PictureError, draw};
pub use plant::MujocoPlant;
pub use python::{PythonError, mujoco};
pub use scenery::{Camera, Scenery};

/// Builds the plant of a scenario with `plant = "mujoco"`: a [`MakePlant`](calibench_sim::mechanics::MakePlant).
///
/// # Errors
/// When MuJoCo cannot simulate the scenario, or is not installed.
pub fn make_plant(scenario: &Scenario, streams: &Streams, parts: &Parts) -> Result<Box<dyn Plant>, PlantError> {
    Ok(Box::new(MujocoPlant::of(&machine(scenario, streams, parts)?)?))
}

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
