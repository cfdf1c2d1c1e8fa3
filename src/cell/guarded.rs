//! A robot that is not told what it must not do.

use nalgebra::Vector3;

use super::{Guards, Manipulator, ManipulatorError, StopRequest};

/// A motion that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// To these joints, rad.
    Joints(Vec<f64>),
    /// Along the axes of the tool, m.
    Tool(Vector3<f64>),
}

/// A motion and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionRecord {
    /// What was asked for.
    pub motion: Motion,
    /// When, on the cell's clock, s.
    pub time_s: f64,
    /// How long it took, s.
    pub duration_s: f64,
    /// Why it was not done, if it was not.
    pub error: Option<ManipulatorError>,
}

/// A manipulator behind [`Guards`]; a motion that they forbid is never sent, and every one that is asked for is told to a log.
pub struct Guarded<M> {
    robot: M,
    guards: Guards,
    stop: StopRequest,
    log: Box<dyn FnMut(&MotionRecord)>,
}

impl<M: Manipulator> Guarded<M> {
    /// Guards this robot; `log` hears of every motion, also of those not sent.
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
            Err(ManipulatorError::Stopped { reason: "a stop was asked for".into() })
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
}
