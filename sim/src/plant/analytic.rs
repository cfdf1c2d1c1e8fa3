//! The mechanics in closed form: the arm's screws, statics at the deflected posture, plungers by geometry.

use std::mem::replace;

use calibench::effects::Kind;
use calibench::robot::{Payload, Pose};
use calibench::units::MM;
use nalgebra::{Point3, Vector3};

use super::{BallForm, Parts, Plant, PlantError, Rest, Stand, within_reach};
use crate::arm::{Arm, Moment};
use crate::contact::{FREE_READING, Touch};
use crate::flaw::Flaws;
use crate::plunger::{Mechanism, PresentedBall};
use crate::side::Side;

/// The arm is at rest when its TCP has less than this to go, m: a thousandth of what the finest indicator tells apart,
const AT_REST: f64 = 1e-10;

/// and no plunger met its ball, or lost it, since the evaluation before: that would change the springs' force by far more than this, N.
const IN_BALANCE: f64 = 1e-6;

/// An arm that still moves by so much has none, m: it is softer than its gauge, or than its own weight asks.
const COLLAPSED: f64 = 1.0 * MM;

/// To what each evaluation shrinks what is to go: the ratio of deflection to arm length.
const USUAL_SHRINKING: f64 = 1e-3;

/// Evaluations in which that is sought; some three are enough.
const MOST_EVALUATIONS: usize = 50;

/// The mechanics in closed form.
pub struct AnalyticPlant {
    arm: Arm,
    balls: Vec<PresentedBall>,
    gauge: [Mechanism; 3],
    artifact_is_there: bool,
    /// Where each plunger hangs up by its side, m, those sides, and where the plungers rest.
    stiction: [f64; 3],
    sides: [Side; 3],
    rest_at: Vector3<f64>,
}

impl AnalyticPlant {
    /// From its parts and what is wrong with them, in a session of about so many seconds.
    pub fn new(parts: &Parts, flaws: Flaws, session_s: f64) -> Self {
        AnalyticPlant {
            stiction: flaws.stiction,
            arm: Arm::new(parts, flaws, session_s),
            balls: parts.balls.clone(),
            gauge: parts.gauge,
            artifact_is_there: true,
            sides: [Side::default(); 3],
            rest_at: Vector3::repeat(FREE_READING),
        }
    }

    /// Seeks the balance of the arm and the plungers' springs; what meets the gauge there.
    ///
    /// A plunger that meets its ball by the arm's giving way, and loses it so, leaves the arm where it was last, some micrometres off.
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

    /// What meets the gauge in the arm's present posture.
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

/// What meets the gauge in one posture of the arm.
#[derive(Debug, Clone, Copy, Default)]
struct Meeting {
    /// The ball within reach, by its place, and in the tool's frame.
    near: Option<usize>,
    ball: Option<PresentedBall>,
    /// Of the springs on the tool, world axes, N.
    force: Vector3<f64>,
}

/// What is left of a way of which each step is in the same proportion to the one before; no less than the last where they do not shrink.
fn to_go(step: f64, before: Option<f64>) -> f64 {
    // The first step may have been along what hardly gives way.
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
        // A plunger that hangs up shows the ball where it is not.
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
