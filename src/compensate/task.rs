//! The task of a compensation: the set-up, the frame of the targets, the tool and the load.

use thiserror::Error;

use super::flange::flange_frame;
use crate::effects::EffectError;
use crate::identify::calibration::{Calibration, MeasuredSetup};
use crate::robot::statics::Payload;
use crate::robot::{FramePose, Robot};

/// The frame of the targets, desired and fake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WorkFrame {
    /// The world of the set-up, as defined by its artifact; the controller's base frame is that world relative to the
    /// identified base.
    World,
    /// A frame relative to the robot's base link: KUKA's `$BASE`. The null frame is that link, KUKA's `$ROBROOT`.
    Base(FramePose),
}

/// The task of a compensation.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Label, session or dataset of the set-up; `None` if there is only one.
    pub setup: Option<String>,
    /// Frame of the targets.
    pub frame: WorkFrame,
    /// TCP frame on the manufacturer's flange (see [`flange_frame`]), KUKA's `$TOOL`; `None` for the tool of the set-up.
    pub tool: Option<FramePose>,
    /// The payload on the flange, centre in the last MDH frame; `None` for the first payload of the set-up.
    pub payload: Option<Payload>,
}

impl Default for Task {
    /// The only set-up with its tool and first payload, targets relative to the robot's base link.
    fn default() -> Self {
        Task { setup: None, frame: WorkFrame::Base(FramePose::default()), tool: None, payload: None }
    }
}

/// The reason why a calibration is not suitable for a task.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum TaskError {
    /// It contains the robot alone.
    #[error(
        "the calibration names no set-up, so neither a tool nor a load is known; identify the robot again, and write the calibration again"
    )]
    NoSetup,
    /// Several set-ups, none chosen.
    #[error("the calibration is of several set-ups ({known}); choose one")]
    SeveralSetups {
        /// Their names.
        known: String,
    },
    /// No such set-up.
    #[error("the calibration has no set-up '{given}'; it has {known}")]
    NoSuchSetup {
        /// As given.
        given: String,
        /// The existing ones.
        known: String,
    },
    /// The robot deflects under torques that cannot be computed.
    #[error(
        "effect '{effect}' needs joint torques, and the robot's description has no link masses; add mass_kg and com_mm to it"
    )]
    NoMasses {
        /// The effect.
        effect: String,
    },
    /// An effect of the calibration cannot be built.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

/// A task, looked up in its calibration.
pub(super) struct Setup<'a> {
    pub measured: &'a MeasuredSetup,
    pub in_world: bool,
    /// TCP in the last MDH frame.
    pub tool: FramePose,
    /// True if that is another tool than the calibrated one.
    pub own_tool: bool,
    pub payload: Payload,
}

impl<'a> Setup<'a> {
    pub fn of(calibration: &'a Calibration, task: &Task) -> Result<Self, TaskError> {
        let setups = &calibration.setups;
        let name = |s: &MeasuredSetup| if s.label.is_empty() { s.dataset.clone() } else { s.label.clone() };
        let known = || setups.iter().map(name).collect::<Vec<_>>().join(", ");
        let measured = match (&task.setup, &setups[..]) {
            (_, []) => return Err(TaskError::NoSetup),
            (None, [only]) => only,
            (None, _) => return Err(TaskError::SeveralSetups { known: known() }),
            (Some(given), _) => {
                let called = |s: &&MeasuredSetup| [&s.label, &s.session, &s.dataset].into_iter().any(|name| name == given);
                let mut found = setups.iter().filter(called);
                let first = found.next().ok_or_else(|| TaskError::NoSuchSetup { given: given.clone(), known: known() })?;
                if found.next().is_some() {
                    return Err(TaskError::SeveralSetups { known: known() });
                }
                first
            }
        };
        let payload = task.payload.clone().or_else(|| measured.payloads.first().cloned()).unwrap_or_else(Payload::none);
        Ok(Setup {
            measured,
            in_world: task.frame == WorkFrame::World,
            tool: task.tool.map_or(measured.tool, |tool| last_from_tool(&calibration.robot, &tool)),
            own_tool: task.tool.is_some(),
            payload,
        })
    }
}

/// A tool on the manufacturer's flange, in the last MDH frame.
fn last_from_tool(robot: &Robot, tool: &FramePose) -> FramePose {
    FramePose::from_pose(&(flange_frame(robot).pose() * tool.pose()))
}
