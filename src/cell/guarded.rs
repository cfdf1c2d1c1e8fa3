//! A robot that is never sent a forbidden motion.

use nalgebra::Vector3;

use super::guards::Guards;
use super::{Manipulator, ManipulatorError, StopRequest};

/// A requested motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// To these joints, rad.
    Joints(Vec<f64>),
    /// Along the axes of the tool, m.
    Tool(Vector3<f64>),
}

/// A motion and its outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionRecord {
    /// The requested motion.
    pub motion: Motion,
    /// Time on the cell's clock, s.
    pub time_s: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Reason why it was not done, if any.
    pub error: Option<ManipulatorError>,
}

/// A manipulator behind [`Guards`]: forbidden motions are never sent, and every requested one is logged.
pub struct Guarded<M> {
    robot: M,
    guards: Guards,
    stop: StopRequest,
    log: Box<dyn FnMut(&MotionRecord)>,
}

impl<M: Manipulator> Guarded<M> {
    /// Guards this robot; `log` receives every motion, including those not sent.
    pub fn new(robot: M, guards: Guards, stop: StopRequest, log: Box<dyn FnMut(&MotionRecord)>) -> Self {
        Guarded { robot, guards, stop, log }
    }

    /// The robot, e.g. for its traffic.
    pub fn robot(&self) -> &M {
        &self.robot
    }

    fn note(
        &mut self,
        motion: Motion,
        act: impl FnOnce(&mut M, &Guards) -> Result<(), ManipulatorError>,
    ) -> Result<(), ManipulatorError> {
        let time_s = self.robot.clock_s();
        let done = if self.stop.is_made() {
            Err(ManipulatorError::Stopped { reason: "a stop was requested".into() })
        } else {
            act(&mut self.robot, &self.guards)
        };
        let duration_s = self.robot.clock_s() - time_s;
        (self.log)(&MotionRecord { motion, time_s, duration_s, error: done.as_ref().err().cloned() });
        done
    }
}

impl<M: Manipulator> Manipulator for Guarded<M> {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        self.robot.joints()
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.note(Motion::Joints(target.to_vec()), |robot, guards| {
            guards.joint_motion(&robot.joints()?, target)?;
            robot.move_joints(target)
        })
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        self.note(Motion::Tool(*offset), |robot, guards| {
            guards.step(&robot.joints()?, offset)?;
            robot.move_in_tool(offset)
        })
    }

    fn clock_s(&mut self) -> f64 {
        self.robot.clock_s()
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
