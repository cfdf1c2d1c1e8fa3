//! Orders to the program on the controller.

use super::{KukaSettings, e6axis, krl_frame};
use crate::robot::FramePose;
use crate::units::{DEG, MM};

/// An order; its target is absolute, so that repeating it has no further effect.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Order {
    /// PTP to these joints, rad.
    Joints(Vec<f64>),
    /// LIN of the tool to this frame in the base.
    Line(FramePose),
    /// Uses this tool in the flange from now on.
    Tool(FramePose),
    /// Uses this base from now on.
    Base(FramePose),
}

/// Tolerance on the end of a motion, m and rad: more than the residual servo error, less than any step for which repetition
/// matters.
const THERE: (f64, f64) = (0.005 * MM, 0.001 * DEG);

impl Order {
    /// Its action number, the variable that holds its target, and the target value.
    pub fn words<'a>(&self, settings: &'a KukaSettings) -> (i64, &'a str, String) {
        let (actions, variables) = (&settings.actions, &settings.variables);
        match self {
            Order::Joints(q) => (actions.joints, &variables.joint_target, e6axis(q).to_string()),
            Order::Line(frame) => (actions.line, &variables.line_target, members(frame)),
            Order::Tool(frame) => (actions.tool, &variables.frame, members(frame)),
            Order::Base(frame) => (actions.base, &variables.frame, members(frame)),
        }
    }

    /// True if the joints (rad) or the frame show that it was carried out.
    pub fn is_done_at(&self, joints: &[f64], position: &FramePose) -> bool {
        match self {
            Order::Joints(target) => {
                joints.len() == target.len() && joints.iter().zip(target).all(|(q, target)| (q - target).abs() < THERE.1)
            }
            Order::Line(target) => {
                let (distance, angle) = apart(target, position);
                distance < THERE.0 && angle < THERE.1
            }
            // Setting a frame again changes nothing.
            Order::Tool(_) | Order::Base(_) => false,
        }
    }

    /// True if the arm moves.
    pub fn is_motion(&self) -> bool {
        matches!(self, Order::Joints(_) | Order::Line(_))
    }
}

/// Distance (m) and angle (rad) between two frames.
pub(super) fn apart(a: &FramePose, b: &FramePose) -> (f64, f64) {
    crate::robot::apart(&a.pose(), &b.pose())
}

/// The six numbers without the type, which is FRAME in one place and E6POS in the other; members not named keep their values.
fn members(frame: &FramePose) -> String {
    let mut structure = krl_frame(frame);
    structure.kind = None;
    structure.to_string()
}
