//! What is compensated for: the set-up, the frame in which targets are given, the tool and the load.

use thiserror::Error;

use super::flange_frame;
use crate::effects::EffectError;
use crate::identify::{Calibration, MeasuredSetup};
use crate::robot::{FramePose, Payload, Robot};

/// The frame in which targets are given and fake ones are told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WorkFrame {
    /// The world of the set-up, as its artifact defines it; the controller's base frame is that world as the identified base sees it.
    World,
    /// A frame on the robot's base: what KUKA calls `$BASE`. The null frame is the robot's root.
    Base(FramePose),
}

/// What is to be compensated for.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Label, session or dataset of the set-up; `None` where there is only one.
    pub setup: Option<String>,
    /// Frame of the targets.
    pub frame: WorkFrame,
    /// TCP frame on the maker's flange (see [`flange_frame`]), KUKA's `$TOOL`; `None` for the tool of the set-up.
    pub tool: Option<FramePose>,
    /// What the flange carries, centre in the last MDH frame; `None` for the first payload of the set-up.
    pub payload: Option<Payload>,
}

impl Default for Task {
    /// The only set-up with its tool and first payload, targets from the robot's root.
    fn default() -> Self {
        Task { setup: None, frame: WorkFrame::Base(FramePose::default()), tool: None, payload: None }
    }
}

/// Why a calibration does not serve a task.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum TaskError {
    /// It was of the robot alone.
    #[error("the calibration names no set-up, so neither a tool nor a load is known; write it anew with `calibench identify`")]
    NoSetup,
    /// Several set-ups, none chosen.
    #[error("the calibration is of several set-ups ({known}); choose one by --session")]
    SeveralSetups {
        /// Their names.
        known: String,
    },
    /// No such set-up.
    #[error("the calibration has no set-up '{given}'; it has {known}")]
    NoSuchSetup {
        /// As given.
        given: String,
        /// Those that it has.
        known: String,
    },
    /// The robot bends under torques that nobody can compute.
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
    /// Whether that is another tool than the one that was calibrated.
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

/// A tool on the maker's flange, in the last MDH frame.
fn last_from_tool(robot: &Robot, tool: &FramePose) -> FramePose {
    FramePose::from_pose(&(flange_frame(robot).pose() * tool.pose()))
}
