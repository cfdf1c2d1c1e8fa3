//! The plan of a scenario: a pool of feasible poses, the selected ones, and the poses for the tracker.

mod error;
mod layout;
mod point_plan;
mod pool_design;
mod tracker_plan;

use std::collections::BTreeMap;

use calibench::cell::guards::Guards;
use calibench::measure::dataset::{Dataset, Measured, Sample};
use calibench::measure::poses::pool::{Candidate, PoolError, PoolRequest, ProbedBall, feasible_pool};
use calibench::measure::poses::selection::{Quota, Request, select};
use calibench::measure::poses::ways::{HomeWays, WayRequest, WaysError, plan_ways};
use calibench::measure::poses::{PlannedPose, ProbingPlan, interleave, interleave_short};
use calibench::robot::solids::Solid;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub use error::PlanError;
pub use layout::{layout, retreat};
pub use point_plan::{PointRequest, plan_points};
pub(crate) use pool_design::PoolDesign;
pub use pool_design::{Chosen, shown};
pub use tracker_plan::{Tour, TrackerPlan, plan_tracker, tour_without_artifact};

use crate::scenario::{Order, PlanToml, Scenario};

/// A measurement plan.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Probings in their order, followed by the reserves; and the paths of the arm.
    pub probing: ProbingPlan,
    /// The selection from which they result.
    pub chosen: Chosen,
}

impl Plan {
    /// Number of probings without reserves.
    pub fn wanted(&self) -> usize {
        self.probing.wanted()
    }
}

/// Chooses the probings of a scenario.
///
/// # Errors
/// When a ball cannot be probed or the pool does not determine the model.
pub fn plan(scenario: &Scenario, seed: u64) -> Result<Plan, PlanError> {
    plan_within(scenario, seed, None)
}

/// Chooses the probings of a scenario such that every motion is within the guards of a cell.
///
/// # Errors
/// As [`plan`].
pub fn plan_within(scenario: &Scenario, seed: u64, guards: Option<&Guards>) -> Result<Plan, PlanError> {
    let balls: Vec<usize> = (0..scenario.ball_ids().len()).collect();
    let mut pool = pool(scenario, &balls, scenario.plan.pool_per_ball, seed)?;
    if let Some(guards) = guards {
        pool.retain(|candidate| guards.joint_motion(&candidate.q_approach, &candidate.q).is_ok());
    }
    let mut left_out = 0;
    loop {
        let mut plan = plan_of(scenario, &pool, seed)?;
        match find_ways(scenario, seed, guards, &mut plan.probing.poses) {
            Ok(ways) => {
                plan.probing.ways = Some(ways);
                return Ok(plan);
            }
            // A posture that is collision-free but cannot be reached is useless.
            Err(WaysError::Blocked(blocked)) if left_out < MOST_LEFT_OUT => {
                let unreached =
                    |q: &[f64]| plan.probing.poses.iter().any(|p| p.contact == q && blocked.iter().any(|b| b.pose == p.id));
                let before = pool.len();
                pool.retain(|candidate| !unreached(&candidate.q));
                left_out += before - pool.len();
            }
            Err(why) => return Err(why.into()),
        }
    }
}

/// Limit on the postures of a pool that may be discarded as unreachable.
const MOST_LEFT_OUT: usize = 40;

/// Finds the paths of a plan in the cell of a scenario.
///
/// # Errors
/// When poses cannot be reached without collision.
pub fn find_ways(
    scenario: &Scenario,
    seed: u64,
    guards: Option<&Guards>,
    poses: &mut [PlannedPose],
) -> Result<HomeWays, WaysError> {
    let cell = scenario.dataset();
    let bodies: Vec<String> = scenario.ball_ids().iter().map(|id| Solid::ball_name(id)).collect();
    let surroundings = scenario.surroundings();
    let request = WayRequest { guards, ..WayRequest::of(&cell, &surroundings, seed) };
    plan_ways(request, &bodies, &-retreat(), poses)
}

/// Selects the probings of a scenario from a pool; their paths are not known yet.
fn plan_of(scenario: &Scenario, pool: &[Candidate], seed: u64) -> Result<Plan, PlanError> {
    let cell = scenario.dataset();
    let samples = pool
        .iter()
        .enumerate()
        .map(|(k, c)| Sample::new(k.to_string(), c.q.clone(), Measured::Ball { ball: c.ball, reading: None }));
    let groups: Vec<usize> = pool.iter().map(|c| c.ball).collect();
    let PlanToml { poses_per_ball, reserves_per_ball, reversed_poses, light_poses, .. } = scenario.plan;
    let pool_design = PoolDesign::new(&cell, samples.collect(), groups, &scenario.model)?;
    let per_ball = |poses: usize| vec![poses; cell.balls.len()];
    let quota = Quota::PerGroup(per_ball(poses_per_ball));
    let selection = select(pool_design.candidates(), &Request { starts: scenario.plan.starts, seed, ..Request::new(quota) })?;
    let chosen = pool_design.chosen(&selection)?;
    // Each further batch is the one that adds most to the batches before it.
    let mut taken = selection.poses.clone();
    let mut counts = per_ball(poses_per_ball);
    let mut further = |more: &[usize]| -> Result<Vec<usize>, PlanError> {
        if more.iter().all(|&m| m == 0) {
            return Ok(Vec::new());
        }
        counts.iter_mut().zip(more).for_each(|(count, more)| *count += more);
        let request = Request { fixed: taken.clone(), starts: 1, seed, ..Request::new(Quota::PerGroup(counts.clone())) };
        let mut added = select(pool_design.candidates(), &request)?.poses;
        added.retain(|p| !taken.contains(p));
        taken.extend(&added);
        Ok(added)
    };
    let balls = cell.balls.len();
    let light: Vec<usize> = (0..balls).map(|b| light_poses / balls + usize::from(b < light_poses % balls)).collect();
    let light = further(&light)?;
    let reserves = further(&per_ball(reserves_per_ball))?;
    let poses = |letter: char, chosen: &[usize], payload: usize, reserve: bool| -> Vec<PlannedPose> {
        let pose = |(k, &p): (usize, &usize)| PlannedPose {
            id: format!("{letter}{:02}", k + 1),
            ball: Some(pool[p].ball),
            payload,
            contact: pool[p].q.clone(),
            approach: pool[p].q_approach.clone(),
            reserve,
            reverses: None,
            via: Vec::new(),
            clearance: None,
        };
        chosen.iter().enumerate().map(pose).collect()
    };
    let taken_from = |poses: &[PlannedPose], order: Vec<usize>| order.into_iter().map(|k| poses[k].clone()).collect();
    let ordered = |poses: Vec<PlannedPose>| match scenario.plan.order {
        Order::Interleaved => taken_from(&poses, interleave(&poses)),
        Order::InterleavedShort => taken_from(&poses, interleave_short(&poses)),
        Order::BallByBall => poses,
    };
    let main = ordered(poses('p', &selection.poses, 0, false));
    // The reversed poses are taken evenly from all balls, in whatever order these are probed.
    let back = |(k, forth): (usize, usize)| {
        let forth = &main[forth];
        PlannedPose { id: format!("b{:02}", k + 1), reverses: Some(forth.id.clone()), ..forth.clone() }
    };
    let reversed: Vec<PlannedPose> = interleave(&main).into_iter().take(reversed_poses).enumerate().map(back).collect();
    let light = ordered(poses('l', &light, 1, false));
    let reserves = poses('r', &reserves, 0, true);
    let poses = [main, reversed, light, reserves].concat();
    Ok(Plan { probing: ProbingPlan { poses, ways: None }, chosen })
}

/// Returns up to `count` postures in which the arm can probe each of the scenario's balls with these indices, ball by ball in
/// the order given: [`Candidate::ball`] is the index into `balls`.
///
/// # Errors
/// When one of these balls cannot be probed.
pub fn pool(scenario: &Scenario, balls: &[usize], count: usize, seed: u64) -> Result<Vec<Candidate>, PoolError> {
    let cell = scenario.dataset();
    let layout = layout(scenario);
    let probed = |&b: &usize| ProbedBall {
        id: cell.balls[b].id.clone(),
        centre: cell.balls[b].position,
        outward: layout.outward[b],
        body: Some(layout.bodies[b].clone()),
    };
    feasible_pool(&PoolRequest {
        robot: &cell.robot,
        base: &cell.base,
        tool: &cell.tool,
        balls: &balls.iter().map(probed).collect::<Vec<_>>(),
        approach: retreat(),
        approach_length: layout.retreat,
        cone: layout.cone,
        surroundings: &layout.surroundings,
        margins: layout.margins,
        count_per_ball: count,
        seed,
    })
}

/// The probings of a plan as samples of the nominal model: a minute each, with random directions of approach.
pub fn nominal_samples(scenario: &Scenario, poses: &[PlannedPose], seed: u64) -> Dataset {
    /// Time from one sample to the next, s: a minute per probing.
    const CENTRING_S: f64 = 60.0;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut sides: BTreeMap<&str, Vec<i8>> = BTreeMap::new();
    let mut samples = Vec::new();
    let on_balls = poses.iter().filter(|p| !p.reserve).filter_map(|p| Some((p, p.ball?)));
    for (k, (pose, ball)) in on_balls.enumerate() {
        let mut side = || if random.random::<bool>() { 1 } else { -1 };
        let plungers = Some([side(), side(), side()]);
        let against = pose.reverses.as_ref().and_then(|id| sides.get(id.as_str()));
        let approach: Vec<i8> =
            against.map_or_else(|| pose.contact.iter().map(|_| side()).collect(), |a| a.iter().map(|s| -s).collect());
        sides.insert(&pose.id, approach.clone());
        samples.push(Sample {
            payload: pose.payload,
            time_s: Some(CENTRING_S * k as f64),
            approach: Some(approach),
            plungers,
            ..Sample::new(&*pose.id, pose.contact.clone(), Measured::Ball { ball, reading: Some(Vector3::zeros()) })
        });
    }
    Dataset { samples, ..scenario.dataset() }
}
