//! A body of the arm or the cell.

use nalgebra::Vector3;

/// The shape of a body, in the axes of the frame that carries it, m.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// All points within `radius` of the segment between `ends`; a ball if the ends are equal.
    Capsule {
        /// Ends of its axis, m.
        ends: [Vector3<f64>; 2],
        /// Radius, m.
        radius: f64,
    },
    /// A box with its edges along the frame's axes.
    Box {
        /// Centre, m.
        centre: Vector3<f64>,
        /// Half its size along each axis, m.
        half_size: Vector3<f64>,
    },
}

impl Shape {
    /// Largest distance of the body from the origin of the frame that carries it, m.
    pub(super) fn reach(&self) -> f64 {
        match self {
            Shape::Capsule { ends, radius } => ends[0].norm().max(ends[1].norm()) + radius,
            Shape::Box { centre, half_size } => (centre.abs() + half_size).norm(),
        }
    }
}

/// A body fixed to a frame: 0 is the base, k the frame of link k. A body fixed in the cell is given in the world, and its
/// `frame` is not used.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Name.
    pub name: String,
    /// Frame that carries it.
    pub frame: usize,
    /// Shape, in that frame.
    pub shape: Shape,
}

impl Solid {
    /// A capsule with this radius (m) between two points (m) of frame `frame`.
    pub fn capsule(name: impl Into<String>, frame: usize, ends: [Vector3<f64>; 2], radius: f64) -> Self {
        Solid { name: name.into(), frame, shape: Shape::Capsule { ends, radius } }
    }

    /// A ball of an artifact with this centre and radius (m).
    pub fn ball(id: &str, centre: Vector3<f64>, radius: f64) -> Self {
        Solid::capsule(Solid::ball_name(id), 0, [centre, centre], radius)
    }

    /// Name of the body of a ball.
    pub fn ball_name(id: &str) -> String {
        format!("ball {id}")
    }

    /// A box around `centre` (m), reaching `half_size` (m) along each axis of frame `frame`.
    pub fn cuboid(name: impl Into<String>, frame: usize, centre: Vector3<f64>, half_size: Vector3<f64>) -> Self {
        Solid { name: name.into(), frame, shape: Shape::Box { centre, half_size } }
    }
}
