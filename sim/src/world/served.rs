//! What a served cell needs of its world beyond the procedure's view: a clock told from outside, the controller's own frames, motions that
//! take their time.

use calibench::cell::ManipulatorError;
use calibench::robot::FramePose;
use nalgebra::Vector3;

use super::SharedWorld;

/// A straight motion up to this long is the small correction of a centring, m: the safe range of the gauge.
const SMALL_MOTION: f64 = 5e-3;

impl SharedWorld {
    /// Tells the time, s since the session began; from now on it passes no other way.
    pub fn tell_time(&self, time_s: f64) {
        let mut world = self.0.borrow_mut();
        world.clock_outside = true;
        world.time_s = world.time_s.max(time_s);
    }

    /// Joint angles that the controller commands, rad (N).
    pub fn commanded(&self) -> Vec<f64> {
        self.0.borrow().joints.commanded().to_vec()
    }

    /// How long the controller takes for a joint motion to `target` (rad, N) at full speed, s.
    pub fn motion_s(&self, target: &[f64]) -> f64 {
        self.0.borrow().joints.large_motion_s(target)
    }

    /// Tells the controller base and tool: those by which it moves straight.
    pub fn set_frames(&self, base: FramePose, tool: FramePose) {
        let mut world = self.0.borrow_mut();
        (world.nominal.base, world.nominal.tool) = (base, tool);
    }

    /// The joints (rad, N) that a motion of the TCP by `offset` (m, tool axes) leads to, by the controller's own model; nothing moves.
    ///
    /// # Errors
    /// When a joint would leave its limits, or the arm cannot move that way.
    pub fn joints_along_tool(&self, offset: &Vector3<f64>) -> Result<Vec<f64>, ManipulatorError> {
        self.0.borrow_mut().along_tool(offset)
    }

    /// Moves straight to `target` (rad, N), which is `distance` (m) away.
    ///
    /// # Errors
    /// When a joint would leave its limits, or the arm is lost.
    pub fn move_straight(&self, target: &[f64], distance: f64) -> Result<(), ManipulatorError> {
        let mut world = self.0.borrow_mut();
        if distance > SMALL_MOTION {
            return world.move_joints(target);
        }
        world.within_limits(target)?;
        world.step_joints(target)
    }
}
