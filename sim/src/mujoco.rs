//! The same cell in MuJoCo: an independent physics that shares no code with the model, through an embedded Python.

mod engine;
mod flaws;
pub mod mjcf;
mod plant;
mod python;
mod scenery;

pub use engine::Engine;
pub use flaws::MujocoFlaws;
pub use plant::MujocoPlant;
pub use scenery::Scenery;
