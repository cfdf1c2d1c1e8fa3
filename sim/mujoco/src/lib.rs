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

pub use engine::{Engine, Field, Thing};
pub use flaws::MujocoFlaws;
pub use machine::machine;
pub use mjcf::Machine;
pub use picture::{PictureError, draw};
pub use plant::MujocoPlant;
pub use python::{PythonError, mujoco};
pub use scenery::{Camera, Scenery};

/// Registers this package as the provider of `plant = "mujoco"` in this process.
pub fn provide() {
    calibench_sim::plant::provide_mujoco(|scenario, streams, parts| {
        Ok(Box::new(MujocoPlant::of(&machine(scenario, streams, parts)?)?))
    });
}

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
