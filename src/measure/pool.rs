//! The pool: postures in which the arm can probe a ball, or stand free before a tracker; what a campaign is selected from.
//!
//! Every draw has a random stream of its own, named by (seed, ball, number of the draw), and draws are taken in order of number:
//! the same seed gives the same pool on any number of threads.

use std::f64::consts::{PI, TAU};
use std::fmt;

use nalgebra::{Rotation3, Translation3, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use thiserror::Error;

use crate::robot::{
    Branch, Chain, ClearanceCheck, FramePose, InverseKinematics, Outcome, Pose, Posture, RelTool, Robot, SiteIndex,
    SphericalWrist, Surroundings, dexterity,
};
use crate::units::{DEG, MM};

/// How far a posture must keep from trouble.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// From every joint limit, rad.
    pub limit: f64,
    /// From a singularity: the least [`dexterity`], m/rad.
    pub dexterity: f64,
    /// Between bodies, m.
    pub clearance: f64,
}

impl Default for Margins {
    /// 2 deg from limits (a centring moves a joint by tenths), |sin A5| of about 0.1 on a KR 6, and 5 mm of air.
    fn default() -> Self {
        Margins { limit: 2.0 * DEG, dexterity: 0.02, clearance: 5.0 * MM }
    }
}

/// A ball to be probed.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbedBall {
    /// Name.
    pub id: String,
    /// Centre in the world, m.
    pub centre: Vector3<f64>,
    /// The middle of the directions, in the world, from which it may be approached: away from its stem.
    pub outward: Unit<Vector3<f64>>,
    /// The ball's own body among the [`Surroundings::fixed`], by name: the TriCal touches it, on purpose.
    pub body: Option<String>,
}

/// What is asked of the pool.
#[derive(Debug, Clone, Copy)]
pub struct PoolRequest<'a> {
    /// The robot as drawn.
    pub robot: &'a Robot,
    /// Its nominal base in the world.
    pub base: &'a FramePose,
    /// The TCP frame in the last frame.
    pub tool: &'a FramePose,
    /// Balls to probe.
    pub balls: &'a [ProbedBall],
    /// Along which, in the tool's axes, the TriCal retreats from a ball.
    pub approach: Unit<Vector3<f64>>,
    /// How far it retreats, m.
    pub approach_length: f64,
    /// Half-angle of the cone about a ball's outward direction in which the retreat must lie, rad; 70 deg is usual.
    pub cone: f64,
    /// What must not be touched.
    pub surroundings: &'a Surroundings,
    /// How far to keep from trouble.
    pub margins: Margins,
    /// Postures wanted of each ball.
    pub count_per_ball: usize,
    /// Seed.
    pub seed: u64,
}

/// A posture in which a ball can be probed.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The ball, by its place in the request.
    pub ball: usize,
    /// Joints that put the nominal TCP on the nominal ball, rad (N).
    pub q: Vec<f64>,
    /// Joints at the far end of the straight approach, rad (N).
    pub q_approach: Vec<f64>,
}

/// How many postures were refused for each reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Refusals {
    /// No joint angles reach the pose.
    pub reach: usize,
    /// Outside joint limits, or too near one.
    pub limits: usize,
    /// Too near a singularity.
    pub singular: usize,
    /// Something touches, or nearly.
    pub touching: usize,
    /// The straight approach is not free, or leaves the joint limits.
    pub approach: usize,
    /// The reflector looks away from the tracker.
    pub facing: usize,
}

impl fmt::Display for Refusals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reasons = [
            (self.reach, "out of reach"),
            (self.limits, "outside joint limits"),
            (self.singular, "near a singularity"),
            (self.touching, "touching something"),
            (self.approach, "without a free approach"),
            (self.facing, "facing away from the tracker"),
        ];
        let mut first = true;
        for (count, reason) in reasons.into_iter().filter(|(count, _)| *count > 0) {
            write!(f, "{}{count} {reason}", if first { "" } else { ", " })?;
            first = false;
        }
        Ok(())
    }
}

impl Refusals {
    fn add(&mut self, other: &Refusals) {
        self.reach += other.reach;
        self.limits += other.limits;
        self.singular += other.singular;
        self.touching += other.touching;
        self.approach += other.approach;
        self.facing += other.facing;
    }
}

/// Why there is no pool.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum PoolError {
    /// A ball cannot be probed in any posture that was tried.
    #[error("ball {ball} cannot be probed: of {tried} tool poses tried, postures were {because}")]
    NoPose {
        /// Its name.
        ball: String,
        /// Tool poses tried.
        tried: usize,
        /// Postures refused.
        because: Refusals,
    },
    /// No posture stands free.
    #[error("no posture stands free: of {tried} tried, {because}")]
    NoFreePose {
        /// Postures tried.
        tried: usize,
        /// Postures refused.
        because: Refusals,
    },
    /// A ball's body is not among the surroundings.
    #[error("ball {ball}: nothing called '{body}' stands in the cell")]
    UnknownBody {
        /// Its name.
        ball: String,
        /// The body named.
        body: String,
    },
}

/// Draws for each one wanted before giving up: an arm that can probe a ball at all does so in one draw of ten or twenty.
const DRAWS_PER_WANTED: usize = 100;
/// Fewest draws before giving up.
const FEWEST_DRAWS: usize = 2_000;
/// Draws handed out at a time: many enough for all threads, few enough to waste little.
const BLOCK: [usize; 2] = [64, 2048];
/// Along the approach, clearance is looked at this often, m: about half the thinnest body of a cell.
const APPROACH_STEP: f64 = 10.0 * MM;

/// Postures from which each ball can be probed: up to `count_per_ball` of each, ball by ball, in order of draw.
///
/// A draw puts the TCP on the ball, its retreat in a random direction of the cone, at a random turn about it, and looks at every
/// branch of the inverse kinematics (of the whole turns of a joint one is taken at random).
///
/// # Errors
/// When some ball cannot be probed at all, with the reasons; when a ball's body is not there.
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

/// Takes draws in order until `wanted` results are found, or too many were in vain.
fn drawn<W: Send, R: Send>(
    wanted: usize,
    workspace: impl Fn() -> W + Sync + Send,
    draw: impl Fn(&mut W, u64) -> (Vec<R>, Refusals) + Sync + Send,
) -> (Vec<R>, usize, Refusals) {
    let most = (wanted * DRAWS_PER_WANTED).max(FEWEST_DRAWS);
    let (mut found, mut tried, mut because) = (Vec::new(), 0, Refusals::default());
    while found.len() < wanted && tried < most {
        let block = (wanted - found.len()).clamp(BLOCK[0], BLOCK[1]).min(most - tried);
        let numbers = tried as u64..(tried + block) as u64;
        let results: Vec<_> = numbers.into_par_iter().map_init(&workspace, &draw).collect();
        for (results, refused) in results {
            found.extend(results);
            because.add(&refused);
        }
        tried += block;
    }
    found.truncate(wanted);
    (found, tried, because)
}

/// A random stream of its own for each draw. `purpose` is the ball, or what the draws are for.
fn stream(seed: u64, purpose: u64, number: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream((purpose << 40) | number);
    random
}

/// How poses are turned into joints.
#[derive(Clone)]
enum Inverse {
    ClosedForm(SphericalWrist),
    Iterative(InverseKinematics),
}

/// What one thread needs to try draws.
#[derive(Clone)]
struct Prober {
    inverse: Inverse,
    flange_from_tool: Pose,
    world_from_base: Pose,
    posture: Posture,
    drawn: Vec<f64>,
    clearance: ClearanceCheck,
    rel_tool: RelTool,
    excepted: Option<usize>,
    branches: Vec<Branch>,
    turns: Vec<[f64; 6]>,
}

impl Prober {
    fn new(request: &PoolRequest<'_>, ball: usize) -> Result<Self, PoolError> {
        let robot = request.robot;
        let clearance = ClearanceCheck::new(robot, request.surroundings);
        let probed = &request.balls[ball];
        let excepted = match &probed.body {
            None => None,
            Some(body) => Some(
                clearance
                    .fixed_named(body)
                    .ok_or_else(|| PoolError::UnknownBody { ball: probed.id.clone(), body: body.clone() })?,
            ),
        };
        Ok(Prober {
            inverse: match SphericalWrist::new(robot) {
                Ok(wrist) => Inverse::ClosedForm(wrist),
                Err(_) => Inverse::Iterative(InverseKinematics::new(robot.joints())),
            },
            flange_from_tool: request.tool.pose(),
            world_from_base: request.base.pose(),
            posture: Posture::new(robot),
            drawn: vec![0.0; SiteIndex::new(robot.joints()).len()],
            clearance,
            rel_tool: RelTool::new(robot),
            excepted,
            branches: Vec::with_capacity(8),
            turns: Vec::with_capacity(64),
        })
    }

    /// Draw `number` for a ball: the postures that hold, and why others do not.
    fn draw(&mut self, request: &PoolRequest<'_>, ball: usize, number: u64) -> (Vec<Candidate>, Refusals) {
        let mut random = stream(request.seed, ball as u64, number);
        let retreat = in_cone(&request.balls[ball].outward, request.cone, &mut random);
        let spin = Rotation3::from_axis_angle(&retreat, random.random_range(0.0..TAU));
        let upright = Rotation3::rotation_between(&request.approach, &retreat)
            // Exactly opposite: half a turn about anything across.
            .unwrap_or_else(|| Rotation3::from_axis_angle(&across(&retreat), PI));
        let world_from_tool = Pose::from_parts(Translation3::from(request.balls[ball].centre), spin * upright);
        let mut found = Vec::new();
        let mut refusals = Refusals::default();
        let mut consider = |prober: &mut Prober, q: &[f64]| match prober.approach(request, q, &mut refusals) {
            Some(q_approach) => found.push(Candidate { ball, q: q.to_vec(), q_approach }),
            None => {}
        };
        match self.inverse.clone() {
            Inverse::ClosedForm(wrist) => {
                let base_from_flange = self.world_from_base.inv_mul(&(world_from_tool * self.flange_from_tool.inverse()));
                let mut branches = std::mem::take(&mut self.branches);
                branches.clear();
                wrist.branches(&base_from_flange, |branch| branches.push(branch));
                let mut limits = 0;
                for branch in &branches {
                    self.turns.clear();
                    wrist.whole_turns(&branch.q, request.margins.limit, |q| self.turns.push(*q));
                    if self.turns.is_empty() {
                        limits += 1;
                        continue;
                    }
                    let q = self.turns[random.random_range(0..self.turns.len())];
                    consider(self, &q);
                }
                refusals.limits += limits;
                refusals.reach += usize::from(branches.is_empty());
                self.branches = branches;
            }
            Inverse::Iterative(mut inverse) => {
                let robot = request.robot;
                let limits = |i: usize| {
                    let [low, high] = robot.links[i].limits;
                    [low + request.margins.limit, high - request.margins.limit]
                };
                let start: Vec<f64> = (0..robot.joints()).map(|i| between(limits(i), &mut random)).collect();
                let mut arm = Chain::nominal(robot, request.base, request.tool);
                let solution = inverse.solve(&mut arm, &world_from_tool, &start, limits);
                match solution.outcome {
                    Outcome::Converged => consider(self, &solution.q),
                    Outcome::JointLimit(_) => refusals.limits += 1,
                    Outcome::Unreachable | Outcome::NotConverged => refusals.reach += 1,
                }
            }
        }
        (found, refusals)
    }

    /// The far end of the approach to the posture `q`, where both and all between are free.
    fn approach(&mut self, request: &PoolRequest<'_>, q: &[f64], refusals: &mut Refusals) -> Option<Vec<f64>> {
        let PoolRequest { robot, base, tool, margins, .. } = *request;
        self.posture.set(robot, base, tool, q, &self.drawn);
        if dexterity(&self.posture, q.len()) < margins.dexterity {
            refusals.singular += 1;
            return None;
        }
        if !self.clearance.is_clear(&self.posture, margins.clearance, self.excepted) {
            refusals.touching += 1;
            return None;
        }
        let steps = (request.approach_length / APPROACH_STEP).ceil().max(1.0);
        let offset = request.approach.into_inner() * (request.approach_length / steps);
        let mut back = q.to_vec();
        for _ in 0..steps as usize {
            let moved = self.rel_tool.shift(robot, base, tool, &mut back, &offset);
            self.posture.set(robot, base, tool, &back, &self.drawn);
            if moved.is_err() || !self.clearance.is_clear(&self.posture, margins.clearance, self.excepted) {
                refusals.approach += 1;
                return None;
            }
        }
        Some(back)
    }
}

/// A direction within `half_angle` (rad) of `axis`, every patch of the sphere there equally likely.
fn in_cone(axis: &Unit<Vector3<f64>>, half_angle: f64, random: &mut ChaCha8Rng) -> Unit<Vector3<f64>> {
    let height = 1.0 - random.random::<f64>() * (1.0 - half_angle.cos());
    let around = random.random_range(0.0..TAU);
    let first = across(axis);
    let second = axis.cross(&first);
    let radius = (1.0 - height * height).max(0.0).sqrt();
    let (sin, cos) = around.sin_cos();
    Unit::new_normalize(axis.into_inner() * height + (first.into_inner() * cos + second * sin) * radius)
}

/// A direction at right angles to `axis`.
fn across(axis: &Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    let away = Vector3::ith(axis.iamin(), 1.0);
    Unit::new_normalize(axis.cross(&away))
}

fn between([low, high]: [f64; 2], random: &mut ChaCha8Rng) -> f64 {
    low + (high - low) * random.random::<f64>()
}

/// That the reflector at the TCP looks at the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// Along which, in the tool's axes, the reflector looks.
    pub looks: Unit<Vector3<f64>>,
    /// The tracker in the world, m.
    pub tracker: Vector3<f64>,
    /// The largest angle between the two, rad; a 1.5-inch reflector takes about 30 deg.
    pub within: f64,
}

impl Facing {
    fn holds(&self, world_from_tool: &Pose) -> bool {
        let looks = world_from_tool.rotation * self.looks.into_inner();
        looks.angle(&(self.tracker - world_from_tool.translation.vector)) <= self.within
    }
}

/// What is asked of free postures.
#[derive(Debug, Clone, Copy)]
pub struct FreePosesRequest<'a> {
    /// The robot as drawn.
    pub robot: &'a Robot,
    /// Its nominal base in the world.
    pub base: &'a FramePose,
    /// The TCP frame in the last frame.
    pub tool: &'a FramePose,
    /// What must not be touched.
    pub surroundings: &'a Surroundings,
    /// How far to keep from trouble.
    pub margins: Margins,
    /// Where the reflector must look; `None` for anywhere.
    pub facing: Option<Facing>,
    /// Postures wanted.
    pub count: usize,
    /// Seed.
    pub seed: u64,
}

/// The `purpose` of the streams of free postures: no ball has this number.
const FREE: u64 = (1 << 24) - 1;

/// Up to `count` postures, uniform in the joints (rad, N), in which nothing touches and the reflector faces the tracker.
///
/// # Errors
/// When there is none.
pub fn free_poses(request: &FreePosesRequest<'_>) -> Result<Vec<Vec<f64>>, PoolError> {
    let FreePosesRequest { robot, base, tool, margins, .. } = *request;
    let none = vec![0.0; SiteIndex::new(robot.joints()).len()];
    let workspace = || (Posture::new(robot), ClearanceCheck::new(robot, request.surroundings));
    let draw = |(posture, clearance): &mut (Posture, ClearanceCheck), number: u64| {
        let mut random = stream(request.seed, FREE, number);
        let within = |[low, high]: [f64; 2]| [low + margins.limit, high - margins.limit];
        let q: Vec<f64> = robot.links.iter().map(|l| between(within(l.limits), &mut random)).collect();
        posture.set(robot, base, tool, &q, &none);
        let mut refusals = Refusals::default();
        if request.facing.is_some_and(|facing| !facing.holds(&posture.world_from_tool(tool))) {
            refusals.facing += 1;
        } else if dexterity(posture, q.len()) < margins.dexterity {
            refusals.singular += 1;
        } else if !clearance.is_clear(posture, margins.clearance, None) {
            refusals.touching += 1;
        } else {
            return (vec![q], refusals);
        }
        (Vec::new(), refusals)
    };
    let (found, tried, because) = drawn(request.count, workspace, draw);
    if found.is_empty() && request.count > 0 {
        return Err(PoolError::NoFreePose { tried, because });
    }
    Ok(found)
}
