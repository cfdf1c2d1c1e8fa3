//! The failures of a centring.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::cell::{IndicatorError, ManipulatorError};
use crate::units::{MM, UM};

/// Probable cause of a step that does not bring the ball closer.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Suspicion {
    /// The tool axis points away from its indicator, or the indicator counts backwards.
    #[error("axis {} has the wrong sign", axis + 1)]
    WrongSign {
        /// Tool axis, counted from 0.
        axis: usize,
    },
    /// Two indicators are exchanged.
    #[error("indicators {} and {} are exchanged", a + 1, b + 1)]
    SwappedAxes {
        /// The lower of the two, counted from 0.
        a: usize,
        /// The higher of the two, counted from 0.
        b: usize,
    },
    /// All three indicators are exchanged, each with another.
    #[error("indicators 1, 2 and 3 are exchanged: they sit in the channels of {}, {} and {}", channels[0] + 1, channels[1] + 1, channels[2] + 1)]
    RotatedAxes {
        /// The channel in which each indicator sits, counted from 0.
        channels: [usize; 3],
    },
    /// None of these explains the readings: the robot moves along axes other than those of the gauge.
    #[error("the robot's tool frame is not the gauge's")]
    WrongToolFrame,
}

impl Suspicion {
    /// True if indicators are exchanged.
    pub(super) fn is_exchange(&self) -> bool {
        matches!(self, Suspicion::SwappedAxes { .. } | Suspicion::RotatedAxes { .. })
    }
}

/// Reason why a ball was not centred. Axes are counted from 0 (messages count from 1), joints from 1; lengths in m.
#[derive(Debug, Error, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CentringFailure {
    /// No plunger is pushed in.
    #[error("no plunger touches a ball; is it there, and is the artifact where it should be?")]
    NoContact,
    /// Some plungers are pushed in and others are not: the ball is beyond the range of the gauge.
    #[error("indicator(s) {} do not touch the ball while others do: it is beyond the range of the gauge", numbers(free))]
    BeyondRange {
        /// The free plungers.
        free: [bool; 3],
    },
    /// A plunger is pushed in to its stop.
    #[error("plunger {} is at its stop", axis + 1)]
    PlungerAtStop {
        /// Axis.
        axis: usize,
    },
    /// The readings did not decrease as expected from the step.
    #[error("a step left {:.3} mm of {:.3} mm: {suspicion}", after / MM, before / MM)]
    NotShrinking {
        /// Distance of the ball before the step.
        before: f64,
        /// Distance after it.
        after: f64,
        /// Cause suggested by the change of the readings.
        suspicion: Suspicion,
    },
    /// The tool oscillates from one side of the ball to the other.
    #[error("the tool swings about the ball, {:.3} mm away; are the robot's units and the indicators' the same?", remaining / MM)]
    Oscillating {
        /// Distance of the ball.
        remaining: f64,
    },
    /// The maximum number of steps was reached.
    #[error("not centred after {steps} steps, {:.1} µm left", remaining / UM)]
    DidNotConverge {
        /// Steps made.
        steps: usize,
        /// Largest residual reading.
        remaining: f64,
    },
    /// A plunger does not follow the ball, or does not come out without contact.
    #[error("indicator {} does not follow: it is stuck, or has lost its mastering", axis + 1)]
    StuckIndicator {
        /// Axis.
        axis: usize,
    },
    /// An indicator does not answer, despite repeated queries.
    #[error("indicator {} does not answer", axis + 1)]
    SilentIndicator {
        /// Axis.
        axis: usize,
    },
    /// An indicator's answers cannot be parsed.
    #[error("indicator {} answers {frame:?}, which cannot be understood", axis + 1)]
    GarbledIndicator {
        /// Axis.
        axis: usize,
        /// Its last answer.
        frame: String,
    },
    /// An indicator reports a fault of its own.
    #[error("indicator {} reports a fault: {detail}", axis + 1)]
    FaultyIndicator {
        /// Axis.
        axis: usize,
        /// The fault as the indicator reports it.
        detail: String,
    },
    /// The connection to the robot is lost.
    #[error("the robot is lost: {detail}")]
    RobotLost {
        /// The symptom.
        detail: String,
    },
    /// The robot is stopped, or not in automatic mode.
    #[error("the robot is stopped: {reason}")]
    RobotStopped {
        /// The reason as the controller reports it.
        reason: String,
    },
    /// The arm touched a body that it must not.
    #[error("collision: {} touched {}; see to the arm before it moves again", between[0], between[1])]
    Collision {
        /// The two bodies.
        between: [String; 2],
    },
    /// The robot refused a motion.
    #[error("the robot refuses the motion: {reason}")]
    RobotRefused {
        /// The reason as the controller reports it.
        reason: String,
    },
    /// The robot accepted a motion, but its joints are not at the target.
    #[error("the robot says it moved, but its joints did not; is its program running, and its override above zero?")]
    RobotDidNotMove,
    /// The ball is further away than the longest step allowed.
    #[error("the ball is {:.3} mm away, mostly along axis {}: further than one step may be", step / MM, axis + 1)]
    StepTooLarge {
        /// Axis of its largest component.
        axis: usize,
        /// Its length.
        step: f64,
    },
    /// A joint would leave its limits.
    #[error("joint {joint} would leave its limits")]
    JointLimit {
        /// Joint.
        joint: usize,
    },
    /// No joint angles reach the target.
    #[error("the target cannot be reached")]
    Unreachable,
}

impl CentringFailure {
    /// Converts an indicator's error on `axis`.
    pub(super) fn of_indicator(axis: usize, error: IndicatorError) -> Self {
        match error {
            IndicatorError::Silent => CentringFailure::SilentIndicator { axis },
            // A free plunger is inside its range; only one pushed in too far can be outside.
            IndicatorError::OverRange => CentringFailure::PlungerAtStop { axis },
            IndicatorError::Fault { detail } => CentringFailure::FaultyIndicator { axis, detail },
            IndicatorError::Garbled { frame } => CentringFailure::GarbledIndicator { axis, frame },
        }
    }

    /// True if the robot may still be commanded. One that is lost may be anywhere, and one that was stopped was stopped by a
    /// person: neither is moved again without a person.
    pub fn robot_obeys(&self) -> bool {
        !matches!(
            self,
            CentringFailure::RobotLost { .. } | CentringFailure::RobotStopped { .. } | CentringFailure::Collision { .. }
        )
    }

    /// True if the robot failed, so that the arm may not be at its commanded position.
    pub(crate) fn is_robot_s(&self) -> bool {
        use CentringFailure::{Collision, JointLimit, RobotDidNotMove, RobotLost, RobotRefused, RobotStopped, Unreachable};
        matches!(
            self,
            RobotLost { .. }
                | RobotStopped { .. }
                | Collision { .. }
                | RobotRefused { .. }
                | RobotDidNotMove
                | JointLimit { .. }
                | Unreachable
        )
    }

    /// The name used in files, followed by a colon and [`CentringFailure::place`] if there is one.
    pub fn name(&self) -> &'static str {
        match self {
            CentringFailure::NoContact => "no_contact",
            CentringFailure::BeyondRange { .. } => "beyond_range",
            CentringFailure::PlungerAtStop { .. } => "plunger_at_stop",
            CentringFailure::NotShrinking { suspicion, .. } => match suspicion {
                Suspicion::WrongSign { .. } => "wrong_sign",
                Suspicion::SwappedAxes { .. } => "swapped_axes",
                Suspicion::RotatedAxes { .. } => "rotated_axes",
                Suspicion::WrongToolFrame => "wrong_tool_frame",
            },
            CentringFailure::Oscillating { .. } => "oscillating",
            CentringFailure::DidNotConverge { .. } => "did_not_converge",
            CentringFailure::StuckIndicator { .. } => "stuck_indicator",
            CentringFailure::SilentIndicator { .. } => "silent_indicator",
            CentringFailure::GarbledIndicator { .. } => "garbled_indicator",
            CentringFailure::FaultyIndicator { .. } => "faulty_indicator",
            CentringFailure::RobotLost { .. } => "robot_lost",
            CentringFailure::RobotStopped { .. } => "robot_stopped",
            CentringFailure::Collision { .. } => "collision",
            CentringFailure::RobotRefused { .. } => "robot_refused",
            CentringFailure::RobotDidNotMove => "robot_did_not_move",
            CentringFailure::StepTooLarge { .. } => "step_too_large",
            CentringFailure::JointLimit { .. } => "joint_limit",
            CentringFailure::Unreachable => "unreachable",
        }
    }

    /// The indicator or the joint concerned, counted from 1, if there is one.
    pub fn place(&self) -> Option<usize> {
        match self {
            CentringFailure::PlungerAtStop { axis }
            | CentringFailure::StuckIndicator { axis }
            | CentringFailure::SilentIndicator { axis }
            | CentringFailure::GarbledIndicator { axis, .. }
            | CentringFailure::FaultyIndicator { axis, .. }
            | CentringFailure::StepTooLarge { axis, .. }
            | CentringFailure::NotShrinking { suspicion: Suspicion::WrongSign { axis }, .. } => Some(axis + 1),
            CentringFailure::JointLimit { joint } => Some(*joint),
            _ => None,
        }
    }

    /// [`CentringFailure::name`] and [`CentringFailure::place`] as written in files, e.g. `silent_indicator:2`.
    pub fn token(&self) -> String {
        self.place().map_or_else(|| self.name().to_owned(), |place| format!("{}:{place}", self.name()))
    }
}

impl From<ManipulatorError> for CentringFailure {
    fn from(error: ManipulatorError) -> Self {
        match error {
            ManipulatorError::Lost { detail } => CentringFailure::RobotLost { detail },
            ManipulatorError::Collision { between } => CentringFailure::Collision { between },
            ManipulatorError::Refused { reason } => CentringFailure::RobotRefused { reason },
            ManipulatorError::JointLimit { joint } => CentringFailure::JointLimit { joint },
            ManipulatorError::Unreachable => CentringFailure::Unreachable,
            ManipulatorError::Stopped { reason } => CentringFailure::RobotStopped { reason },
        }
    }
}

fn numbers(which: &[bool; 3]) -> String {
    let named: Vec<String> = (0..3).filter(|&k| which[k]).map(|k| (k + 1).to_string()).collect();
    named.join(", ")
}
