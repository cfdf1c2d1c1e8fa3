//! The same cell in MuJoCo: an independent physics that shares no code with the model, through an embedded Python.

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
