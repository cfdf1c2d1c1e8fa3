//! Functions of a robot controller, beyond moving the arm, that a program needs.

use std::error::Error;

use thiserror::Error;

use super::gauge::Traffic;
use super::{Manipulator, ManipulatorError};
use crate::robot::{FramePose, Pose};

/// A robot behind its controller: a [`Manipulator`] that also reports the controller's state and accepts the settings of a
/// campaign.
///
/// A new controller is a folder beside [`super::kuka`] and [`super::ur`] whose robot implements this trait, and one variant of
/// [`super::RobotSettings`]; nothing else in the library or the program depends on the kind of controller.
pub trait Driver: Manipulator {
    /// Reads the state of the controller. Nothing is written and nothing moves.
    ///
    /// # Errors
    /// When the controller does not answer.
    fn state(&mut self) -> Result<ControllerState, DriverError>;

    /// Sets the speed override, %, and the tool frame in the flange, and verifies both. Nothing moves.
    ///
    /// # Errors
    /// When the controller refuses either, or a motion of an earlier session is pending.
    fn prepare(&mut self, speed_percent: u8, flange_from_tool: &FramePose) -> Result<(), ManipulatorError>;

    /// Reads the controller's frames at the present position of the arm.
    ///
    /// # Errors
    /// When the controller does not answer.
    fn frames(&mut self) -> Result<ControllerFrames, DriverError>;

    /// Bytes exchanged with the controller so far.
    fn traffic(&self) -> Traffic;
}

/// State of a controller at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerState {
    /// Operating mode, as the controller names it.
    pub mode: String,
    /// State of the robot program, as the controller names it.
    pub program: String,
    /// True if the emergency stop is pressed; `None` if the controller does not report it.
    pub emergency_stop: Option<bool>,
    /// Speed override, %.
    pub speed_percent: f64,
    /// Mass of the payload that it computes with, kg; `None` if it is not known.
    pub payload_kg: Option<f64>,
    /// Mass of the payload that [`Driver::prepare`] tells it, kg; `None` if it tells none.
    pub told_payload_kg: Option<f64>,
    /// Reason why the robot may not move now, if any.
    pub unfit: Option<String>,
    /// The pending order of an earlier session, if any, and the remedy.
    pub pending: Option<String>,
}

/// Frames as the controller has them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerFrames {
    /// The base in the robot's root.
    pub root_from_base: FramePose,
    /// The tool in the base, by the controller's model of the arm.
    pub base_from_tool: FramePose,
    /// The tool in the flange.
    pub flange_from_tool: FramePose,
}

impl ControllerFrames {
    /// The flange in the robot's root, by the controller's model of the arm.
    pub fn root_from_flange(&self) -> Pose {
        self.root_from_base.pose() * self.base_from_tool.pose() * self.flange_from_tool.pose().inverse()
    }
}

/// A controller did not answer, or gave an unusable answer; worded by its driver.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct DriverError(Box<dyn Error + Send + Sync>);

impl DriverError {
    /// Wraps the error of a driver.
    pub fn new(error: impl Error + Send + Sync + 'static) -> Self {
        DriverError(Box::new(error))
    }
}
