//! The robot's own controller: it knows only the nominal model, its encoders have finite resolution, and its gears lose motion.

use calibench::robot::Robot;
use calibench::units::{ARCSEC, DEG};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Deserialize;

use crate::dahl_friction::DahlFriction;

/// Joint angles that a controller reports as its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Reports {
    /// The encoder readings.
    #[default]
    Actual,
    /// The commanded angles.
    Commanded,
}

/// Accuracy with which the joints reach their commanded angles. All sizes are one-sigma, per joint where a list is given.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ControllerSpec {
    /// Resolution of the joint angles reported by the encoders.
    pub encoder_resolution_deg: f64,
    /// Residual servo error after a large motion; seen by the encoders.
    pub servo_error_arcsec: Vec<f64>,
    /// Lost motion of the gears after a large motion; not seen by the encoders.
    pub lost_motion_arcsec: Vec<f64>,
    /// Half-width of the play that small motions must take up first; not seen by the encoders.
    pub small_move_play_arcsec: Vec<f64>,
    /// Typical joint speed.
    pub speed_deg_per_s: f64,
    /// Time to come to rest after each motion.
    pub settle_s: f64,
    /// Joint angles that it reports.
    #[serde(default)]
    pub reports: Reports,
    /// True if it reports the commanded joint angles as well.
    #[serde(default)]
    pub log_commanded: bool,
    /// Final temperature rise of the robot.
    #[serde(default)]
    pub warm_up_c: f64,
    /// Time constant of the warm-up; 0 for an immediate rise.
    #[serde(default)]
    pub warm_up_s: f64,
}

/// Temperature at the start of a session, °C: the reference temperature of dimensional metrology (ISO 1).
const COLD_C: f64 = 20.0;

impl ControllerSpec {
    /// Temperature of the robot at this time into the session, °C: `T0 + dT (1 - exp(-t / tau))`.
    pub fn temperature_c(&self, time_s: f64) -> f64 {
        let share = if self.warm_up_s > 0.0 { -(-time_s / self.warm_up_s).exp_m1() } else { 1.0 };
        COLD_C + self.warm_up_c * share
    }
}

/// Joint angles: commanded, shown by the encoders, and true at the links.
#[derive(Debug, Clone)]
pub struct Joints {
    spec: ControllerSpec,
    commanded: Vec<f64>,
    servo: Vec<f64>,
    motor: Vec<f64>,
    lost: Vec<f64>,
    play: Vec<f64>,
    /// Hysteresis of each joint at full Dahl friction state, rad, and that state.
    hysteresis: Vec<f64>,
    side: Vec<DahlFriction>,
}

impl Joints {
    /// Joints at zero, with this hysteresis (rad) per joint, scaled by its Dahl friction state.
    pub fn new(robot: &Robot, spec: &ControllerSpec, hysteresis: &[f64]) -> Self {
        let zero = vec![0.0; robot.joints()];
        Joints {
            spec: spec.clone(),
            commanded: zero.clone(),
            servo: zero.clone(),
            motor: zero.clone(),
            lost: zero.clone(),
            play: zero,
            hysteresis: hysteresis.to_vec(),
            side: vec![DahlFriction::default(); robot.joints()],
        }
    }

    /// Joint angles as reported, rad.
    pub fn reported(&self) -> &[f64] {
        match self.spec.reports {
            Reports::Actual => &self.motor,
            Reports::Commanded => &self.commanded,
        }
    }

    /// Joint angles as commanded, rad.
    pub fn commanded(&self) -> &[f64] {
        &self.commanded
    }

    /// True joint angles at the links, rad.
    pub fn links(&self) -> Vec<f64> {
        let by_side = |i: usize| self.hysteresis[i] * self.side[i].value();
        (0..self.motor.len()).map(|i| self.motor[i] + self.lost[i] + self.play[i] + by_side(i)).collect()
    }

    fn step(&self, angle: f64) -> f64 {
        let resolution = self.spec.encoder_resolution_deg * DEG;
        if resolution > 0.0 { (angle / resolution).round() * resolution } else { angle }
    }

    /// Duration of a large motion to these joints (rad), s.
    pub fn large_motion_s(&self, target: &[f64]) -> f64 {
        let longest = target.iter().zip(&self.motor).map(|(to, from)| (to - from).abs()).fold(0.0, f64::max);
        longest / (self.spec.speed_deg_per_s * DEG) + self.spec.settle_s
    }

    /// A large motion: servo error and lost motion are redrawn. Returns its duration, s.
    pub fn move_large(&mut self, target: &[f64], rng: &mut ChaCha8Rng) -> f64 {
        let duration_s = self.large_motion_s(target);
        for i in 0..target.len() {
            let mut normal = |sigma: f64| sigma * ARCSEC * Distribution::<f64>::sample(&StandardNormal, rng);
            self.servo[i] = normal(self.spec.servo_error_arcsec[i]);
            self.lost[i] = normal(self.spec.lost_motion_arcsec[i]);
            self.side[i].moved(target[i] - self.commanded[i], self.hysteresis[i]);
            self.commanded[i] = target[i];
            self.motor[i] = self.step(target[i] + self.servo[i]);
            self.play[i] = 0.0;
        }
        duration_s
    }

    /// Passes these joints (rad) without stopping: nothing is drawn. Returns the duration, s.
    pub fn pass(&mut self, target: &[f64]) -> f64 {
        let duration_s = self.large_motion_s(target) - self.spec.settle_s;
        for (i, &angle) in target.iter().enumerate() {
            self.side[i].moved(angle - self.commanded[i], self.hysteresis[i]);
            self.commanded[i] = angle;
            self.motor[i] = self.step(angle + self.servo[i]);
        }
        duration_s
    }

    /// A small motion: the motors keep their servo error, and go to the nearest encoder step; the links follow once the play
    /// is taken up. Returns its duration, s.
    pub fn move_small(&mut self, target: &[f64]) -> f64 {
        for i in 0..target.len() {
            let half = self.spec.small_move_play_arcsec[i] * ARCSEC;
            let moved = self.step(target[i] + self.servo[i]) - self.motor[i];
            self.side[i].moved(target[i] - self.commanded[i], self.hysteresis[i]);
            self.commanded[i] = target[i];
            self.motor[i] += moved;
            self.play[i] = (self.play[i] - moved).clamp(-half, half);
        }
        self.spec.settle_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn links_follow_a_small_motion_only_after_the_play() {
        let spec = ControllerSpec {
            encoder_resolution_deg: 0.0,
            servo_error_arcsec: vec![0.0],
            lost_motion_arcsec: vec![0.0],
            small_move_play_arcsec: vec![1.0],
            speed_deg_per_s: 100.0,
            settle_s: 0.5,
            reports: Reports::Actual,
            log_commanded: false,
            warm_up_c: 0.0,
            warm_up_s: 0.0,
        };
        let one = || vec![0.0];
        let mut joints = Joints {
            spec,
            commanded: one(),
            servo: one(),
            motor: one(),
            lost: one(),
            play: one(),
            hysteresis: one(),
            side: vec![DahlFriction::default()],
        };
        joints.move_large(&[0.1], &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(joints.links(), [0.1]);
        joints.move_small(&[0.1 + 0.5 * ARCSEC]);
        assert!((joints.links()[0] - 0.1).abs() < 1e-15, "inside the play the link stands still");
        joints.move_small(&[0.1 + 3.0 * ARCSEC]);
        assert!((joints.links()[0] - 0.1 - 2.0 * ARCSEC).abs() < 1e-15, "beyond it the link follows, short by the play");
        joints.move_small(&[0.1 + 1.0 * ARCSEC]);
        assert!((joints.links()[0] - 0.1 - 2.0 * ARCSEC).abs() < 1e-15, "on the way back the play must be crossed first");
    }
}
