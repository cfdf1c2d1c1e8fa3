//! Interface of a served cell to its world beyond the procedure's view: an external clock, and motions by joints.

use calibench::cell::ManipulatorError;
use calibench::robot::statics::Payload;
use calibench::units::MM;

use super::SharedWorld;

/// Limit for a straight motion to count as a small correction, m: the safe range of the gauge, 5 mm, along all three axes.
const SMALL_MOTION: f64 = 8.7 * MM;

impl SharedWorld {
    /// Sets the time, s since the session began; from now on it advances in no other way.
    pub fn tell_time(&self, time_s: f64) {
        let mut world = self.0.borrow_mut();
        world.clock_outside = true;
        world.time_s = world.time_s.max(time_s);
    }

    /// Joint angles that the controller commands, rad (N).
    pub fn commanded(&self) -> Vec<f64> {
        self.0.borrow().joints.commanded().to_vec()
    }

    /// The payload that is really on the flange.
    pub fn true_payload(&self) -> Payload {
        let world = self.0.borrow();
        world.payloads.get(world.payload).cloned().unwrap_or_else(Payload::none)
    }

    /// Sign of each joint's last motion; 0 if it never moved.
    pub fn last_motion(&self) -> Vec<i8> {
        self.0.borrow().joint_motion.signs().to_vec()
    }

    /// Duration of a joint motion to `target` (rad, N) at full speed, s.
    pub fn motion_s(&self, target: &[f64]) -> f64 {
        self.0.borrow().joints.large_motion_s(target)
    }

    /// Moves in a straight line to the joints `target` (rad, N), the TCP by `distance` (m).
    ///
    /// # Errors
    /// When a joint would leave its limits, or the plant has failed.
    pub fn move_straight(&self, target: &[f64], distance: f64) -> Result<(), ManipulatorError> {
        let mut world = self.0.borrow_mut();
        if distance > SMALL_MOTION {
            return world.move_joints(target);
        }
        world.within_limits(target)?;
        world.step_joints(target)
    }
}
