//! The devices of a real cell, opened.

use thiserror::Error;

use super::{Cell, Place};
use crate::cell::StopRequest;
use crate::cell::gauge::{AsciiIndicator, Port, open_serial, open_socket};
use crate::cell::kuka::{KukaRobot, LinkError};
use crate::robot::{FramePose, world_from_tool};

/// An indicator of a cell, whatever its port.
pub type CellGauge = AsciiIndicator<Box<dyn Port + Send>>;

/// An indicator's port does not open.
#[derive(Debug, Error)]
#[error("indicator {} at {place} cannot be opened: {error}", axis + 1)]
pub struct PortError {
    /// Axis, counted from 0.
    pub axis: usize,
    /// Where it should be.
    pub place: Place,
    /// What the system says.
    pub error: std::io::Error,
}

impl Cell {
    /// The indicator of an axis (counted from 0).
    ///
    /// # Errors
    /// When its port does not open.
    pub fn open_indicator(&self, axis: usize) -> Result<CellGauge, PortError> {
        let indicator = &self.indicators[axis];
        let port: std::io::Result<Box<dyn Port + Send>> = match &indicator.place {
            Place::Serial(path, line) => open_serial(path, *line).map(|port| Box::new(port) as _),
            Place::Socket(address) => open_socket(address, indicator.settings.timeout).map(|port| Box::new(port) as _),
        };
        let port = port.map_err(|error| PortError { axis, place: indicator.place.clone(), error })?;
        Ok(AsciiIndicator::new(port, indicator.settings.clone()))
    }

    /// All three indicators.
    ///
    /// # Errors
    /// When one of their ports does not open.
    pub fn open_indicators(&self) -> Result<[CellGauge; 3], PortError> {
        Ok([self.open_indicator(0)?, self.open_indicator(1)?, self.open_indicator(2)?])
    }

    /// The robot; nothing is written and nothing moves.
    ///
    /// # Errors
    /// When it does not answer.
    pub fn open_robot(&self, stop: StopRequest) -> Result<KukaRobot, LinkError> {
        KukaRobot::connect(self.robot.clone(), stop)
    }

    /// The tool as the controller wants it, in its flange.
    pub fn flange_from_tool(&self) -> FramePose {
        FramePose::from_pose(&(self.last_frame_from_flange.pose().inverse() * self.dataset.tool.pose()))
    }

    /// How far the controller's flange stands from where the robot's model has it, at joints `q`: distance (m) and angle (rad). Millimetres
    /// are a controller that knows its arm better than the drawing; more is another arm, or another flange.
    ///
    /// # Errors
    /// When the controller does not answer.
    pub fn disagreement(&self, robot: &mut KukaRobot, q: &[f64]) -> Result<(f64, f64), LinkError> {
        let (tool, base) = robot.frames()?;
        let root_from_flange = base.pose() * robot.position()?.pose() * tool.pose().inverse();
        let modelled = world_from_tool(&self.dataset.robot, &FramePose::default(), &self.last_frame_from_flange, q);
        let between = modelled.inv_mul(&root_from_flange);
        Ok((between.translation.vector.norm(), between.rotation.angle()))
    }
}
