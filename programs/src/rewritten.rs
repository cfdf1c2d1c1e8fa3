//! A position with its result.

use calibench::compensate::{Desired, Fake, Target, Warnings};

/// A position with its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Rewritten {
    /// Line, counted from 1.
    pub line: usize,
    /// Its name, or the instruction that has it.
    pub name: String,
    /// The desired position.
    pub target: Target,
    /// The target commanded instead.
    pub fake: Fake,
    /// Warnings, as that it lies outside what was measured.
    pub warnings: Warnings,
}

impl Rewritten {
    /// The desired TCP as the program has it, m; `None` for a position of joints.
    pub fn target_xyz(&self) -> Option<[f64; 3]> {
        match &self.target.desired {
            Desired::Pose { pose, .. } => Some(pose.translation.vector.into()),
            Desired::Joints(_) => None,
        }
    }

    /// From the desired TCP to the one commanded, m, along the axes of the position's base; `None` for joints.
    pub fn shift(&self) -> Option<[f64; 3]> {
        let [x, y, z] = self.target_xyz()?;
        let fake = self.fake.pose.translation.vector;
        Some([fake.x - x, fake.y - y, fake.z - z])
    }
}
