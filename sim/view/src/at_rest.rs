//! An arm at rest: the poses of all its links.

use calibench::robot::Pose;

/// An arm at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// `world_from_frame` of the base and of every link, the base first (N + 1).
    pub frames: Vec<Pose>,
    /// `world_from_tool`.
    pub tool: Pose,
}

impl Arm {
    /// Largest distance between frames of this arm and of another, m.
    pub fn off(&self, other: &Arm) -> f64 {
        let far = |(a, b): (&Pose, &Pose)| (a.translation.vector - b.translation.vector).norm();
        self.frames.iter().zip(&other.frames).map(far).fold(far((&self.tool, &other.tool)), f64::max)
    }
}
