//! Bodies of the arm and the cell, for clearance.

use nalgebra::Vector3;

/// A capsule fixed to a frame: 0 is the base, k the frame of link k; points in that frame, m.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Name.
    pub name: String,
    /// Frame that carries it.
    pub frame: usize,
    /// Ends of its axis, m.
    pub ends: [Vector3<f64>; 2],
    /// Radius, m.
    pub radius: f64,
}
