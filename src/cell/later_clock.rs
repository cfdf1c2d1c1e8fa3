//! A robot whose clock goes on from where an earlier day left it.

use nalgebra::Vector3;

use super::{Manipulator, ManipulatorError};

/// A robot whose seconds count from the beginning of a campaign that was interrupted, not from its own connection.
#[derive(Debug)]
pub struct LaterClock<M> {
    robot: M,
    from_s: f64,
}

impl<M> LaterClock<M> {
    /// That robot; the cell's clock stands at `from_s` (s) when its own stands at zero.
    pub fn new(robot: M, from_s: f64) -> Self {
        LaterClock { robot, from_s }
    }
}

impl<M: Manipulator> Manipulator for LaterClock<M> {
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
}
