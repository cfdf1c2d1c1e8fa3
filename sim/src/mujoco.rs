//! MuJoCo, by its Python package in an interpreter inside this process.

mod python;

pub use python::{PythonError, mujoco};
