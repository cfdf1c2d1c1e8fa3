//! The pool: postures in which the arm can probe a ball, from which those of a campaign are selected.

pub use super::draws::{Margins, PoolError, Refusals};

use std::f64::consts::{PI, TAU};

use nalgebra::{Rotation3, Translation3, Unit, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draws::{Purpose, between, drawn, stream, within};
use crate::robot::inverse::{Branch, Chain, InverseKinematics, Outcome, SphericalWrist, dexterity};
use crate::robot::kinematics::Posture;
use crate::robot::rel_tool::RelTool;
use crate::robot::sites::SiteIndex;
use crate::robot::solids::{ClearanceCheck, Surroundings};
use crate::robot::{FramePose, Pose, Robot};
use crate::units::MM;

/// A ball to be probed.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbedBall {
    /// Name.
    pub id: String,
    /// Centre in the world, m.
    pub centre: Vector3<f64>,
    /// Central axis of the directions, in the world, from which it may be approached: away from its stem.
    pub outward: Unit<Vector3<f64>>,
    /// The ball's own body among the [`Surroundings::fixed`], by name: the TriCal touches it intentionally.
    pub body: Option<String>,
}

/// Request for a pool.
#[derive(Debug, Clone, Copy)]
pub struct PoolRequest<'a> {
    /// The nominal model of the robot.
    pub robot: &'a Robot,
    /// Its nominal base in the world.
    pub base: &'a FramePose,
    /// The TCP frame in the last frame.
    pub tool: &'a FramePose,
    /// Balls to probe.
    pub balls: &'a [ProbedBall],
    /// Direction in the tool's axes in which the TriCal retreats from a ball.
    pub approach: Unit<Vector3<f64>>,
    /// Length of the retreat, m.
    pub approach_length: f64,
    /// Half-angle of the cone about a ball's outward direction in which the retreat must lie, rad; 70 deg is usual.
    pub cone: f64,
    /// Bodies that must not be touched.
    pub surroundings: &'a Surroundings,
    /// Margins to keep.
    pub margins: Margins,
    /// Number of postures requested for each ball.
    pub count_per_ball: usize,
    /// Seed.
    pub seed: u64,
}

/// A posture in which a ball can be probed.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Index of the ball in the request.
    pub ball: usize,
    /// Joints that put the nominal TCP on the nominal ball, rad (N).
    pub q: Vec<f64>,
    /// Joints at the far end of the straight approach, rad (N).
    pub q_approach: Vec<f64>,
}

/// Interval at which the clearance of an approach is checked, m: about half the thinnest body of a cell.
const APPROACH_STEP: f64 = 10.0 * MM;

/// Returns postures from which each ball can be probed: `count_per_ball` of each, ball by ball, in order of draw; fewer for a
/// ball that can be probed by hardly one tool pose in a hundred.
///
/// A draw puts the TCP on the ball, its retreat in a random direction of the cone, at a random rotation about it, and considers
/// every branch of the inverse kinematics (of the whole turns of a joint one is chosen at random).
///
/// # Errors
/// When some ball cannot be probed at all, with the reasons; when a ball's body does not exist.
pub fn feasible_pool(request: &PoolRequest<'_>) -> Result<Vec<Candidate>, PoolError> {
    let mut pool = Vec::with_capacity(request.count_per_ball * request.balls.len());
    for (ball, probed) in request.balls.iter().enumerate() {
        let prober = Prober::new(request, ball)?;
        let (found, tried, because) =
            drawn(request.count_per_ball, || prober.clone(), |prober, number| prober.draw(request, ball, number));
        if found.is_empty() && request.count_per_ball > 0 {
            return Err(PoolError::NoPose { ball: probed.id.clone(), tried, because });
        }
        pool.extend(found);
    }
    Ok(pool)
}

/// Inverse kinematics of a robot.
#[derive(Clone)]
enum Inverse {
    ClosedForm { wrist: Box<SphericalWrist>, branches: Vec<Branch>, turns: Vec<[f64; 6]> },
    Iterative(InverseKinematics),
}

/// State of one thread for trying draws.
#[derive(Clone)]
struct Prober {
    inverse: Inverse,
    approach: Approach,
}

impl Prober {
    fn new(request: &PoolRequest<'_>, ball: usize) -> Result<Self, PoolError> {
        let inverse = match SphericalWrist::new(request.robot) {
            Ok(wrist) => {
                Inverse::ClosedForm { wrist: Box::new(wrist), branches: Vec::with_capacity(8), turns: Vec::with_capacity(64) }
            }
            Err(_) => Inverse::Iterative(InverseKinematics::new(request.robot.joints())),
        };
        Ok(Prober { inverse, approach: Approach::new(request, ball)? })
    }

    /// Makes draw `number` for a ball: the feasible postures, and the reasons against the others.
    fn draw(&mut self, request: &PoolRequest<'_>, ball: usize, number: u64) -> (Vec<Candidate>, Refusals) {
        let mut random = stream(request.seed, Purpose::Ball(ball), number);
        let world_from_tool = random_pose(request, &request.balls[ball], &mut random);
        let mut found = Vec::new();
        let mut refusals = Refusals::default();
        let approach = &mut self.approach;
        let mut consider = |q: &[f64], refusals: &mut Refusals| {
            if let Some(q_approach) = approach.far_end(request, q, refusals) {
                found.push(Candidate { ball, q: q.to_vec(), q_approach });
            }
        };
        match &mut self.inverse {
            Inverse::ClosedForm { wrist, branches, turns } => {
                let world_from_flange = world_from_tool * request.tool.pose().inverse();
                branches.clear();
                wrist.branches(&request.base.pose().inv_mul(&world_from_flange), |branch| branches.push(branch));
                refusals.reach += usize::from(branches.is_empty());
                for branch in branches {
                    turns.clear();
                    wrist.whole_turns(&branch.q, request.margins.limit, |q| turns.push(*q));
                    if turns.is_empty() {
                        refusals.limits += 1;
                    } else {
                        consider(&turns[random.random_range(0..turns.len())], &mut refusals);
                    }
                }
            }
            Inverse::Iterative(inverse) => {
                let robot = request.robot;
                let limits = |i: usize| within(robot.links[i].drawn_range(), request.margins.limit);
                let start: Vec<f64> = (0..robot.joints()).map(|i| between(limits(i), &mut random)).collect();
                let mut arm = Chain::nominal(robot, request.base, request.tool);
                let solution = inverse.solve(&mut arm, &world_from_tool, &start, limits);
                match solution.outcome {
                    Outcome::Converged => consider(&solution.q, &mut refusals),
                    Outcome::JointLimit(_) => refusals.limits += 1,
                    Outcome::Unreachable | Outcome::NotConverged => refusals.reach += 1,
                }
            }
        }
        (found, refusals)
    }
}

/// A pose with the TCP on the ball, its retreat in the cone, and a random rotation about the retreat.
fn random_pose(request: &PoolRequest<'_>, ball: &ProbedBall, random: &mut ChaCha8Rng) -> Pose {
    let retreat = in_cone(&ball.outward, request.cone, random);
    let spin = Rotation3::from_axis_angle(&retreat, random.random_range(0.0..TAU));
    let upright = Rotation3::rotation_between(&request.approach, &retreat)
        // Exactly opposite: half a turn about any perpendicular axis.
        .unwrap_or_else(|| Rotation3::from_axis_angle(&across(&retreat), PI));
    Pose::from_parts(Translation3::from(ball.centre), spin * upright)
}

/// Checks postures on a ball and their straight approach.
#[derive(Clone)]
struct Approach {
    posture: Posture,
    nominal: Vec<f64>,
    clearance: ClearanceCheck,
    rel_tool: RelTool,
    /// The ball's own body.
    excepted: Option<usize>,
}

impl Approach {
    fn new(request: &PoolRequest<'_>, ball: usize) -> Result<Self, PoolError> {
        let robot = request.robot;
        let ProbedBall { id, body, .. } = &request.balls[ball];
        let clearance = ClearanceCheck::new(robot, request.surroundings);
        let unknown = |body: &String| PoolError::UnknownBody { ball: id.clone(), body: body.clone() };
        let excepted = body.as_ref().map(|body| clearance.fixed_named(body).ok_or_else(|| unknown(body))).transpose()?;
        Ok(Approach {
            posture: Posture::new(robot),
            nominal: vec![0.0; SiteIndex::new(robot.joints()).len()],
            clearance,
            rel_tool: RelTool::new(robot),
            excepted,
        })
    }

    fn is_clear(&mut self, request: &PoolRequest<'_>, q: &[f64]) -> bool {
        self.posture.set(request.robot, request.base, request.tool, q, &self.nominal);
        self.clearance.is_clear(&self.posture, request.margins.clearance, self.excepted)
    }

    /// The far end of the approach to the posture `q`, if both and the path between are free.
    fn far_end(&mut self, request: &PoolRequest<'_>, q: &[f64], refusals: &mut Refusals) -> Option<Vec<f64>> {
        if !self.is_clear(request, q) {
            refusals.touching += 1;
            return None;
        }
        if dexterity(&self.posture, q.len()) < request.margins.dexterity {
            refusals.singular += 1;
            return None;
        }
        let steps = (request.approach_length / APPROACH_STEP).ceil().max(1.0);
        let offset = request.approach.into_inner() * (request.approach_length / steps);
        let mut back = q.to_vec();
        for _ in 0..steps as usize {
            let moved = self.rel_tool.shift(request.robot, request.base, request.tool, &mut back, &offset);
            if moved.is_err() || !self.is_clear(request, &back) {
                refusals.approach += 1;
                return None;
            }
        }
        Some(back)
    }
}

/// A random direction within `half_angle` (rad) of `axis`, uniform on the sphere.
fn in_cone(axis: &Unit<Vector3<f64>>, half_angle: f64, random: &mut ChaCha8Rng) -> Unit<Vector3<f64>> {
    let height = 1.0 - random.random::<f64>() * (1.0 - half_angle.cos());
    let around = random.random_range(0.0..TAU);
    let first = across(axis);
    let second = axis.cross(&first);
    let radius = (1.0 - height * height).max(0.0).sqrt();
    let (sin, cos) = around.sin_cos();
    Unit::new_normalize(axis.into_inner() * height + (first.into_inner() * cos + second * sin) * radius)
}

/// A direction perpendicular to `axis`.
fn across(axis: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    let away = Vector3::ith(axis.iamin(), 1.0);
    Unit::new_normalize(axis.cross(&away))
}
