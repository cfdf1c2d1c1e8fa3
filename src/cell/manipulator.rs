//! The robot as required by the procedure.

use nalgebra::Vector3;
use thiserror::Error;

/// Reason why the robot did not carry out a command.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum ManipulatorError {
    /// The connection is lost; nothing is known about the arm.
    #[error("the robot is lost: {detail}")]
    Lost {
        /// The symptom.
        detail: String,
    },
    /// The controller refused the motion.
    #[error("the robot refuses the motion: {reason}")]
    Refused {
        /// The reason as the controller reports it.
        reason: String,
    },
    /// The target is outside a joint's limits.
    #[error("joint {joint} would leave its limits")]
    JointLimit {
        /// Joint, counted from 1.
        joint: usize,
    },
    /// The arm touched a body that it must not, and has stopped.
    #[error("collision: {} touched {}", between[0], between[1])]
    Collision {
        /// The two bodies.
        between: [String; 2],
    },
    /// No joint angles reach the target.
    #[error("the target cannot be reached")]
    Unreachable,
    /// The emergency stop is pressed or the operating mode is wrong.
    #[error("the robot is stopped: {reason}")]
    Stopped {
        /// The reason as the controller reports it.
        reason: String,
    },
}

/// A robot that moves on command and reports its joint angles.
pub trait Manipulator {
    /// Joint angles as the encoders report them, rad (N).
    ///
    /// # Errors
    /// When the robot does not answer.
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError>;

    /// Moves all joints to `target` (rad, N) and waits until the arm is at rest.
    ///
    /// # Errors
    /// When the motion is refused, or the robot is lost.
    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError>;

    /// Moves through these joints (rad, N), each motion a straight line in joint space as in a synchronous point-to-point
    /// motion, and waits at the last until the arm is at rest. It need not come to rest at the others, but must not cut their
    /// corners.
    ///
    /// # Errors
    /// When a motion is refused, or the robot is lost; the arm may then be anywhere on the path.
    fn move_along(&mut self, way: &[Vec<f64>]) -> Result<(), ManipulatorError> {
        way.iter().try_for_each(|target| self.move_joints(target))
    }

    /// Moves the TCP by `offset` (m) along the axes of the tool frame, keeping its orientation, by the controller's model
    /// (RelTool).
    ///
    /// # Errors
    /// When the motion is refused, or the robot is lost.
    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError>;

    /// Seconds on the cell's clock since the session began.
    fn clock_s(&mut self) -> f64;

    /// Joint angles commanded by the controller at rest, rad (N), if it distinguishes them from those read back.
    fn commanded(&mut self) -> Option<Vec<f64>> {
        None
    }

    /// Temperature of the robot, °C, if it reports one.
    fn temperature_c(&mut self) -> Option<f64> {
        None
    }

    /// Moment of the load about each joint's axis, N·m (N), if the controller measures it at rest; the drive holds the opposite.
    fn torques(&mut self) -> Option<Vec<f64>> {
        None
    }
}

impl<T: Manipulator + ?Sized> Manipulator for &mut T {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        (**self).joints()
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        (**self).move_joints(target)
    }

    fn move_along(&mut self, way: &[Vec<f64>]) -> Result<(), ManipulatorError> {
        (**self).move_along(way)
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        (**self).move_in_tool(offset)
    }

    fn clock_s(&mut self) -> f64 {
        (**self).clock_s()
    }

    fn commanded(&mut self) -> Option<Vec<f64>> {
        (**self).commanded()
    }

    fn temperature_c(&mut self) -> Option<f64> {
        (**self).temperature_c()
    }

    fn torques(&mut self) -> Option<Vec<f64>> {
        (**self).torques()
    }
}
