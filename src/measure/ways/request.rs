//! The request for a way.

use crate::cell::Guards;
use crate::robot::{FramePose, Robot, Surroundings};

/// The cell in which a way is searched for, and the clearance to keep.
#[derive(Debug, Clone, Copy)]
pub struct WayRequest<'a> {
    /// The nominal model of the robot.
    pub robot: &'a Robot,
    /// Its nominal base in the world.
    pub base: &'a FramePose,
    /// The TCP frame in the last frame.
    pub tool: &'a FramePose,
    /// Bodies that must not be touched.
    pub surroundings: &'a Surroundings,
    /// Clearance to keep, m. If an end of a way has less, the way has no less than that end.
    pub margin: f64,
    /// Limits on the robot's motions, if known: joint limits with a margin, a box for the TCP.
    pub guards: Option<&'a Guards>,
    /// Seed of the search, where one is needed.
    pub seed: u64,
}

impl WayRequest<'_> {
    /// True if the guards allow this motion.
    pub(super) fn is_allowed(&self, from: &[f64], to: &[f64]) -> bool {
        self.guards.is_none_or(|guards| guards.joint_motion(from, to).is_ok())
    }
}
