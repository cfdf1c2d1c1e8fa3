//! The same cell in MuJoCo: an independent physics that shares no code with the model, through an embedded Python.

mod engine;
mod flaws;
mod mjcf;
mod picture;
mod plant;
mod python;
mod scenery;

pub use engine::{Engine, Field, Thing};
pub use flaws::MujocoFlaws;
pub use mjcf::Machine;
pub use picture::{PictureError, draw};
pub use plant::{MujocoPlant, machine};
pub use python::{PythonError, mujoco};
pub use scenery::{Camera, Scenery};
