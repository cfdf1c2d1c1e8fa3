//! Positions with their results, and the program that they make.

use super::scan::Remark;
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

/// A program with its positions compensated.
#[derive(Debug, Clone, PartialEq)]
pub struct RewrittenProgram {
    /// The content of the file: the old one, with other numbers.
    pub bytes: Vec<u8>,
    /// Number of positions found.
    pub positions: usize,
    /// Those that were rewritten.
    pub rewritten: Vec<Rewritten>,
    /// Statements that were not rewritten, or are right only under a condition, by line.
    pub remarks: Vec<Remark>,
    /// Assumptions made, one sentence each.
    pub assumed: Vec<String>,
}

impl RewrittenProgram {
    /// True if no position stays uncompensated.
    pub fn is_whole(&self) -> bool {
        !self.remarks.iter().any(|remark| remark.blocks)
    }

    pub(super) fn refuse(&mut self, line: usize, what: &str, reason: &str, remedy: &str) {
        let [what, reason, remedy] = [what, reason, remedy].map(str::to_owned);
        self.remarks.push(Remark { line, what, reason, remedy, blocks: true });
    }
}
