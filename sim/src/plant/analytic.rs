//! The mechanics in closed form: screws of the arm, statics at the deflected posture, plungers by geometry.

use std::mem::replace;

use calibench::effects::situation::Kind;
use calibench::robot::Pose;
use calibench::robot::statics::Payload;
use calibench::units::MM;
use nalgebra::{Point3, Vector3};

use super::arm::{Arm, Moment};
use crate::contact::{FREE_READING, Touch};
use crate::dahl_friction::DahlFriction;
use crate::flaw::Flaws;
use crate::mechanics::{BallForm, Parts, Plant, PlantError, Rest, Stand, within_reach};
use crate::plunger::{Mechanism, PresentedBall};

/// The arm is at rest when the remaining motion of its TCP is below this, m: a thousandth of the finest indicator's resolution,
const AT_REST: f64 = 1e-10;

/// and no plunger gained or lost contact since the previous evaluation: that would change the springs' force by far
/// more than this, N.
const IN_BALANCE: f64 = 1e-6;

/// An arm that still moves by this much has no equilibrium, m: it is too soft for its gauge or its own weight.
const COLLAPSED: f64 = 1.0 * MM;

/// Factor by which each evaluation reduces the remaining motion: the ratio of deflection to arm length.
const USUAL_SHRINKING: f64 = 1e-3;

/// Limit on evaluations; some three are enough.
const MOST_EVALUATIONS: usize = 50;

/// The mechanics in closed form.
pub struct AnalyticPlant {
    arm: Arm,
    balls: Vec<PresentedBall>,
    gauge: [Mechanism; 3],
    artifact_is_there: bool,
    /// Stiction of each plunger at full friction state, m, the Dahl friction states, and the rest positions of the plungers.
    stiction: [f64; 3],
    sides: [DahlFriction; 3],
    rest_at: Vector3<f64>,
}

impl AnalyticPlant {
    /// Builds the plant from its parts and their flaws, for a session of about `session_s` seconds.
    pub fn new(parts: &Parts, flaws: Flaws, session_s: f64) -> Self {
        AnalyticPlant {
            stiction: flaws.stiction,
            arm: Arm::new(parts, flaws, session_s),
            balls: parts.balls.clone(),
            gauge: parts.gauge,
            artifact_is_there: true,
            sides: [DahlFriction::default(); 3],
            rest_at: Vector3::repeat(FREE_READING),
        }
    }

    /// Finds the equilibrium of the arm and the plungers' springs; returns the contact with the gauge there.
    ///
    /// If the arm's deflection makes a plunger gain contact, and the deflection under that contact makes it lose contact
    /// again, the arm remains at its last position, some micrometres off.
    fn balance(&mut self, stand: &Stand<'_>) -> Result<Meeting, PlantError> {
        self.arm.move_motors(stand.motors);
        let mut meeting = self.meeting();
        let mut went_before = None;
        for _ in 0..MOST_EVALUATIONS {
            let moment = Moment {
                kind: meeting.near.map(Kind::Ball).or((!self.artifact_is_there).then_some(Kind::Point)),
                reading: meeting.ball.map(|b| b.centre),
                force: meeting.force,
            };
            let went = self.arm.give_way(stand, &moment);
            let before = replace(&mut meeting, self.meeting());
            let change = (meeting.force - before.force).norm();
            if to_go(went, went_before) < AT_REST && change < IN_BALANCE && meeting.near == before.near {
                return Ok(meeting);
            }
            went_before = Some(went);
        }
        match went_before {
            Some(went) if went >= COLLAPSED || went.is_nan() => {
                let detail = format!("after {MOST_EVALUATIONS} evaluations the arm still moves by {:.1} mm", went / MM);
                Err(PlantError::Restless { detail })
            }
            _ => Ok(meeting),
        }
    }

    /// Contact with the gauge in the arm's present posture.
    fn meeting(&self) -> Meeting {
        let near = if self.artifact_is_there { within_reach(&self.balls, &self.arm.tcp()) } else { None };
        let Some(k) = near else {
            return Meeting::default();
        };
        let pose = self.arm.world_from_tool();
        let PresentedBall { centre, radius } = self.balls[k];
        let moved = Point3::from(centre + self.arm.target_moved());
        let ball = PresentedBall { centre: pose.inverse_transform_point(&moved).coords, radius };
        let pushed: Vector3<f64> = self.gauge.iter().map(|plunger| plunger.force_from(Some(&ball))).sum();
        Meeting { near, ball: Some(ball), force: pose.rotation * pushed }
    }
}

/// Contact with the gauge in one posture of the arm.
#[derive(Debug, Clone, Copy, Default)]
struct Meeting {
    /// Index of the ball within reach, and that ball in the tool's frame.
    near: Option<usize>,
    ball: Option<PresentedBall>,
    /// Force of the springs on the tool, world axes, N.
    force: Vector3<f64>,
}

/// Remaining motion if successive steps form a geometric series; the last step itself if they do not shrink.
fn to_go(step: f64, before: Option<f64>) -> f64 {
    // The first step may have been in a stiff direction.
    match before.map(|before| (step / before).max(USUAL_SHRINKING)) {
        Some(ratio) if ratio < 0.5 => step * ratio / (1.0 - ratio),
        _ => step,
    }
}

impl Plant for AnalyticPlant {
    fn settle(&mut self, stand: &Stand<'_>, form: &mut BallForm) -> Result<Rest, PlantError> {
        let ball = self.balance(stand)?.ball;
        let at = ball.map_or(Vector3::repeat(FREE_READING), |b| b.centre);
        for (k, side) in self.sides.iter_mut().enumerate() {
            side.moved(at[k] - self.rest_at[k], self.stiction[k]);
        }
        self.rest_at = at;
        // Stiction displaces the ball as seen by the plunger.
        let hung = Vector3::from_fn(|k, _| self.stiction[k] * self.sides[k].value());
        let shown = ball.map(|b| PresentedBall { centre: form.touched(&(b.centre - hung)), ..b });
        let touches = self.gauge.each_ref().map(|plunger| plunger.meet(shown.as_ref()));
        Ok(Rest { world_from_tool: self.arm.world_from_tool(), ball, touches, target_moved: self.arm.target_moved() })
    }

    fn frames(&self) -> Vec<Pose> {
        self.arm.frames()
    }

    fn frames_at(&mut self, motors: &[f64]) -> Result<(Vec<Pose>, Pose), PlantError> {
        self.arm.move_motors(motors);
        Ok((self.arm.frames(), self.arm.world_from_tool()))
    }

    fn seat(&mut self, master_radius: Option<f64>) -> Result<[Touch; 3], PlantError> {
        let master = master_radius.map(|radius| PresentedBall { centre: Vector3::zeros(), radius });
        Ok(self.gauge.each_ref().map(|plunger| plunger.meet(master.as_ref())))
    }

    fn mount(&mut self, payload: &Payload) -> Result<(), PlantError> {
        self.arm.payload = payload.clone();
        Ok(())
    }

    fn remove_artifact(&mut self) {
        self.artifact_is_there = false;
    }
}
