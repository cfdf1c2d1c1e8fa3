//! A robot whose clock continues from that of an earlier session.

use nalgebra::Vector3;

use super::{Manipulator, ManipulatorError};

/// A robot whose clock counts from the beginning of an interrupted campaign, not from its own connection.
#[derive(Debug)]
pub struct OffsetClock<M> {
    robot: M,
    from_s: f64,
}

impl<M> OffsetClock<M> {
    /// Wraps `robot`; the cell's clock shows `from_s` (s) when the robot's own shows zero.
    pub fn new(robot: M, from_s: f64) -> Self {
        OffsetClock { robot, from_s }
    }
}

impl<M: Manipulator> Manipulator for OffsetClock<M> {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        self.robot.joints()
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.robot.move_joints(target)
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        self.robot.move_in_tool(offset)
    }

    fn clock_s(&mut self) -> f64 {
        self.from_s + self.robot.clock_s()
    }

    fn commanded(&mut self) -> Option<Vec<f64>> {
        self.robot.commanded()
    }

    fn temperature_c(&mut self) -> Option<f64> {
        self.robot.temperature_c()
    }

    fn torques(&mut self) -> Option<Vec<f64>> {
        self.robot.torques()
    }
}
