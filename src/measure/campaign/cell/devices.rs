//! Opening of the devices of a real cell.

use super::Cell;
use crate::cell::gauge::{CellGauge, PortError};
use crate::cell::{Driver, DriverError, StopRequest};
use crate::robot::kinematics::world_from_tool;
use crate::robot::{FramePose, apart};

impl Cell {
    /// Opens all three indicators; `None` if the cell has none.
    ///
    /// # Errors
    /// When one of their ports cannot be opened.
    pub fn open_indicators(&self) -> Result<Option<[CellGauge; 3]>, PortError> {
        let Some([x, y, z]) = &self.indicators else { return Ok(None) };
        Ok(Some([x.open(0)?, y.open(1)?, z.open(2)?]))
    }

    /// Connects to the robot. Nothing is written and nothing moves.
    ///
    /// # Errors
    /// When the controller does not answer.
    pub fn open_robot(&self, stop: StopRequest) -> Result<Box<dyn Driver>, DriverError> {
        self.robot.connect(stop)
    }

    /// The tool frame in the controller's flange, as needed by the controller.
    pub fn flange_from_tool(&self) -> FramePose {
        FramePose::from_pose(&(self.last_frame_from_flange.pose().inverse() * self.dataset.tool.pose()))
    }

    /// Distance (m) and angle (rad) between the controller's flange and that of the robot's model, at joints `q`. Millimetres
    /// indicate a controller whose model is better than the nominal one; more indicates another arm, or another flange.
    ///
    /// # Errors
    /// When the controller does not answer.
    pub fn disagreement(&self, robot: &mut dyn Driver, q: &[f64]) -> Result<(f64, f64), DriverError> {
        let root_from_flange = robot.frames()?.root_from_flange();
        let modelled = world_from_tool(&self.dataset.robot, &FramePose::default(), &self.last_frame_from_flange, q);
        Ok(apart(&modelled, &root_from_flange))
    }
}
