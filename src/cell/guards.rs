//! Limits on the commands to a robot, whatever the plan or the indicators require.

pub use super::guarded::{Guarded, Motion, MotionRecord};

use std::sync::Arc;

use nalgebra::{Translation3, Vector3};
use thiserror::Error;

use super::ManipulatorError;
use crate::robot::kinematics::world_from_tool;
use crate::robot::rel_tool::{RelToolError, rel_tool};
use crate::robot::{FramePose, Robot};
use crate::units::{DEG, MM};

/// Limits on every motion, by the nominal model.
///
/// ```
/// use std::sync::Arc;
///
/// use calibench::cell::guards::{Forbidden, Guards};
/// use calibench::nalgebra::Vector3;
/// use calibench::robot::{FramePose, built_in};
/// use calibench::units::{DEG, MM};
///
/// let guards = Guards {
///     robot: Arc::new(built_in("kr6_r700").ok_or("built in")?),
///     base: FramePose::default(),
///     tool: FramePose::default(),
///     joint_margin: 1.0 * DEG,
///     max_step: 5.0 * MM,
///     workspace: None,
/// };
/// // A step of 6 mm is too long; A1 at 169.5 deg is within a degree of its limit of 170 deg.
/// let q = [0.0, -90.0, 90.0, 0.0, 45.0, 0.0].map(|q| q * DEG);
/// assert!(matches!(guards.step(&q, &Vector3::new(0.0, 6.0 * MM, 0.0)), Err(Forbidden::StepTooLong { .. })));
/// let turned = [169.5 * DEG, q[1], q[2], q[3], q[4], q[5]];
/// assert!(matches!(guards.joint_motion(&q, &turned), Err(Forbidden::JointLimit { joint: 1, .. })));
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone)]
pub struct Guards {
    /// The arm.
    pub robot: Arc<Robot>,
    /// Its base in the world.
    pub base: FramePose,
    /// Its TCP frame in the last frame.
    pub tool: FramePose,
    /// Minimum distance of every joint from its limits, rad.
    pub joint_margin: f64,
    /// Longest step along one axis of the tool, m.
    pub max_step: f64,
    /// Box that the TCP must not leave, world, m: lower and upper corner.
    pub workspace: Option<[Vector3<f64>; 2]>,
}

/// Reason why a motion is not attempted.
#[derive(Debug, Error, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Forbidden {
    /// The number of joints differs from that of the arm.
    #[error("a target of {given} joints is not for an arm of {joints}")]
    WrongArm {
        /// Number given.
        given: usize,
        /// Number of the arm.
        joints: usize,
    },
    /// A joint would come too close to its limit.
    #[error("joint {joint} would come within {:.1} degrees of its limit", margin / DEG)]
    JointLimit {
        /// Joint, counted from 1.
        joint: usize,
        /// The margin, rad.
        margin: f64,
    },
    /// The TCP would leave its box.
    #[error("the TCP would leave the workspace, at ({:.0}, {:.0}, {:.0}) mm", at.x / MM, at.y / MM, at.z / MM)]
    OutsideWorkspace {
        /// TCP position, world, m.
        at: Vector3<f64>,
    },
    /// A step along the tool is too long.
    #[error("a step of {:.3} mm is longer than {:.3} mm", step / MM, max / MM)]
    StepTooLong {
        /// Its largest component, m.
        step: f64,
        /// The limit, m.
        max: f64,
    },
    /// No joints reach the end of the step.
    #[error("no joint angles reach the end of the step")]
    Unreachable,
}

impl From<Forbidden> for ManipulatorError {
    fn from(forbidden: Forbidden) -> Self {
        match forbidden {
            Forbidden::JointLimit { joint, .. } => ManipulatorError::JointLimit { joint },
            Forbidden::Unreachable => ManipulatorError::Unreachable,
            other => ManipulatorError::Refused { reason: format!("not sent: {other}") },
        }
    }
}

/// Number of points at which the path of a joint motion is checked: every 50 mm on a path of a metre.
const LOOKS: usize = 20;

impl Guards {
    /// TCP of the nominal arm, world, m.
    pub fn tcp(&self, q: &[f64]) -> Vector3<f64> {
        world_from_tool(&self.robot, &self.base, &self.tool, q).translation.vector
    }

    /// Checks a motion of the joints from `from` to `target` (rad), each at constant speed, as in a synchronous PTP.
    ///
    /// # Errors
    /// The reason why it is forbidden.
    pub fn joint_motion(&self, from: &[f64], target: &[f64]) -> Result<(), Forbidden> {
        let joints = self.robot.joints();
        if let Some(given) = [from.len(), target.len()].into_iter().find(|&given| given != joints) {
            return Err(Forbidden::WrongArm { given, joints });
        }
        self.joints(target)?;
        // The arm may start outside its box and enter it: points of the path outside the box are then no error.
        let began_inside = self.inside(&self.tcp(from));
        for k in 1..=LOOKS {
            let share = k as f64 / LOOKS as f64;
            let q: Vec<f64> = from.iter().zip(target).map(|(a, b)| a + share * (b - a)).collect();
            let at = self.tcp(&q);
            if (began_inside || k == LOOKS) && !self.inside(&at) {
                return Err(Forbidden::OutsideWorkspace { at });
            }
        }
        Ok(())
    }

    /// Checks a motion of the TCP by `offset` (m, tool axes) from joints `from` (rad).
    ///
    /// # Errors
    /// The reason why it is forbidden.
    pub fn step(&self, from: &[f64], offset: &Vector3<f64>) -> Result<(), Forbidden> {
        let step = offset.amax();
        // A clamped step equals the limit up to rounding; NaN counts as longer.
        if !step.is_finite() || step > self.max_step * (1.0 + 1e-9) {
            return Err(Forbidden::StepTooLong { step, max: self.max_step });
        }
        if from.len() != self.robot.joints() {
            return Err(Forbidden::WrongArm { given: from.len(), joints: self.robot.joints() });
        }
        let end = world_from_tool(&self.robot, &self.base, &self.tool, from) * Translation3::from(*offset);
        if !self.inside(&end.translation.vector) {
            return Err(Forbidden::OutsideWorkspace { at: end.translation.vector });
        }
        let moved = rel_tool(&self.robot, &self.base, &self.tool, from, offset).map_err(|error| match error {
            RelToolError::JointLimit { joint } => Forbidden::JointLimit { joint, margin: 0.0 },
            RelToolError::Singular => Forbidden::Unreachable,
        })?;
        self.joints(&moved)
    }

    fn joints(&self, q: &[f64]) -> Result<(), Forbidden> {
        match self.robot.outside_limits(q, -self.joint_margin) {
            Some(joint) => Err(Forbidden::JointLimit { joint: joint + 1, margin: self.joint_margin }),
            None => Ok(()),
        }
    }

    fn inside(&self, at: &Vector3<f64>) -> bool {
        self.workspace.is_none_or(|[low, high]| (0..3).all(|k| (low[k]..=high[k]).contains(&at[k])))
    }
}
