//! The plan of a scenario: a pool of feasible poses, the selected ones, and the poses for the tracker.

use std::collections::BTreeMap;

use calibench::assess::CellLayout;
use calibench::cell::Guards;
use calibench::effects;
use calibench::identify::{
    FitError, Model, Observability, Problem, ProblemError, Use, independent_parameters, missing, observability_of,
};
use calibench::measure::selection::{Candidates, Quota, Request, Selection, SelectionError, select};
use calibench::measure::{
    Blocked, BlockedPose, Candidate, Dataset, Facing, FreePosesRequest, HomeWays, Margins, Measured, PlannedPose, PoolError,
    PoolRequest, ProbedBall, ProbingPlan, Sample, WAY_MARGIN, WayFinder, WayRequest, WaysError, feasible_pool, free_poses,
    interleave, interleave_short, plan_ways,
};
use calibench::robot::{Surroundings, world_from_tool};
use calibench::units::{DEG, MM};
use nalgebra::{DMatrix, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use crate::scenario::{Order, PlanToml, Scenario, TRACKER_POOL, TrackerToml, ball_body};

/// Why there is no plan.
#[derive(Debug, Error)]
pub enum PlanError {
    /// A ball cannot be probed, or there is no free space.
    #[error(transparent)]
    Pool(#[from] PoolError),
    /// Too little of the free space is seen by the tracker.
    #[error("{found} postures stand free and face the tracker, where {wanted} are wanted")]
    TooFewFree {
        /// Postures found.
        found: usize,
        /// Postures wanted, for identification and validation together.
        wanted: usize,
    },
    /// No poses for the tracker.
    #[error("no poses for the tracker")]
    Tracker(#[source] Box<PlanError>),
    /// No selection.
    #[error(transparent)]
    Selection(#[from] SelectionError),
    /// The arm cannot get to the poses, or from one to the next.
    #[error(transparent)]
    Ways(#[from] WaysError),
    /// Model and cell do not go together.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The pool does not determine the model.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Poses chosen out of a pool.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// Feasible poses found.
    pub pool: usize,
    /// Parameters that the pool can tell apart.
    pub parameters: Vec<String>,
    /// Observability of the chosen poses, SI.
    pub observability: Observability,
    /// O1 of each start of the search.
    pub starts: Vec<f64>,
}

/// What will be measured.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Probings, in their order, reserves after them; and the ways of the arm.
    pub probing: ProbingPlan,
    /// How they were chosen.
    pub trical: Chosen,
}

impl Plan {
    /// Number of probings wanted, reserves not counted.
    pub fn wanted(&self) -> usize {
        wanted(&self.probing.poses)
    }
}

/// Number of poses that are not reserves.
pub fn wanted(poses: &[PlannedPose]) -> usize {
    poses.iter().filter(|p| !p.reserve).count()
}

/// Postures one after the other, and the ways between them.
#[derive(Debug, Clone, Default)]
pub struct Tour {
    /// The postures, rad.
    pub poses: Vec<Vec<f64>>,
    /// Joints by which the arm gets to each from the one before it, to the first from where it was before, rad; empty where it moves at
    /// once.
    pub via: Vec<Vec<Vec<f64>>>,
    /// Whether no ways were sought: the arm is put from one to the next.
    pub has_no_ways: bool,
}

impl Tour {
    /// From one to the next, whatever is between.
    pub fn direct(poses: Vec<Vec<f64>>) -> Self {
        Tour { via: vec![Vec::new(); poses.len()], poses, has_no_ways: true }
    }
}

/// Joint targets for the tracker.
#[derive(Debug, Clone)]
pub struct TrackerPlan {
    /// For identification, chosen by observability.
    pub identification: Tour,
    /// How they were chosen.
    pub chosen: Chosen,
    /// To add to the probings, chosen by observability.
    pub points: Tour,
    /// For validation, at random.
    pub validation: Tour,
}

/// Chooses the probings of a scenario.
///
/// # Errors
/// When a ball cannot be probed or the pool does not determine the model.
pub fn plan(scenario: &Scenario, seed: u64) -> Result<Plan, PlanError> {
    plan_within(scenario, seed, None)
}

/// The same, every motion within the guards of a cell.
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
            // A posture that stands clear but cannot be got to is as good as none.
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

/// Postures of a pool that may turn out to be out of the arm's way.
const MOST_LEFT_OUT: usize = 40;

/// The ways of a plan in the cell of a scenario.
///
/// # Errors
/// When poses cannot be reached clear.
pub fn find_ways(
    scenario: &Scenario,
    seed: u64,
    guards: Option<&Guards>,
    poses: &mut [PlannedPose],
) -> Result<HomeWays, WaysError> {
    let cell = scenario.dataset();
    let bodies: Vec<String> = scenario.ball_ids().iter().map(|id| ball_body(id)).collect();
    let surroundings = scenario.surroundings();
    let request = WayRequest { guards, ..way_request(&cell, &surroundings, seed) };
    plan_ways(request, &bodies, &-retreat(), poses)
}

/// What ways are sought in: the nominal arm of a cell among these bodies.
pub fn way_request<'a>(cell: &'a Dataset, surroundings: &'a Surroundings, seed: u64) -> WayRequest<'a> {
    let Dataset { robot, base, tool, .. } = cell;
    WayRequest { robot, base, tool, surroundings, margin: WAY_MARGIN, guards: None, seed }
}

/// The probings of a scenario out of a pool; their ways are not known yet.
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
    let selection = select(&pool_design.candidates, &Request { starts: scenario.plan.starts, seed, ..Request::new(quota) })?;
    let trical = pool_design.chosen(&selection)?;
    // Each further lot is what adds most to all before it.
    let mut taken = selection.poses.clone();
    let mut counts = per_ball(poses_per_ball);
    let mut further = |more: &[usize]| -> Result<Vec<usize>, PlanError> {
        if more.iter().all(|&m| m == 0) {
            return Ok(Vec::new());
        }
        counts.iter_mut().zip(more).for_each(|(count, more)| *count += more);
        let request = Request { fixed: taken.clone(), starts: 1, seed, ..Request::new(Quota::PerGroup(counts.clone())) };
        let mut added = select(&pool_design.candidates, &request)?.poses;
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
            ball: pool[p].ball,
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
    // Of all balls alike, in whatever order they are probed.
    let back = |(k, forth): (usize, usize)| {
        let forth = &main[forth];
        PlannedPose { id: format!("b{:02}", k + 1), reverses: Some(forth.id.clone()), ..forth.clone() }
    };
    let reversed: Vec<PlannedPose> = interleave(&main).into_iter().take(reversed_poses).enumerate().map(back).collect();
    let light = ordered(poses('l', &light, 1, false));
    let reserves = poses('r', &reserves, 0, true);
    let poses = [main, reversed, light, reserves].concat();
    Ok(Plan { probing: ProbingPlan { poses, ways: None }, trical })
}

/// Up to `count` postures in which the arm can probe each of the scenario's balls at these places among them, ball by ball as listed:
/// [`Candidate::ball`] is the place in `balls`.
///
/// # Errors
/// When one of them cannot be probed.
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

/// Chooses the tracker's poses, and finds the ways through them from the posture `start` (rad), where one is given.
///
/// # Errors
/// When there is no free space that the tracker sees.
pub fn plan_tracker(scenario: &Scenario, seed: u64, start: Option<&[f64]>) -> Result<TrackerPlan, PlanError> {
    let cell = scenario.dataset();
    let layout = layout(scenario);
    let mut free = free_poses(&FreePosesRequest {
        robot: &cell.robot,
        base: &cell.base,
        tool: &cell.tool,
        // The artifact is removed before the tracker measures (paper, section 6); the table stays.
        surroundings: &layout.without_artifact,
        margins: layout.margins,
        facing: layout.facing,
        count: TRACKER_POOL + scenario.tracker.validation_poses,
        seed,
    })?;
    let TrackerToml { identification_poses, validation_poses, .. } = scenario.tracker;
    let wanted = identification_poses.max(scenario.plan.point_poses) + validation_poses;
    if free.len() < wanted {
        return Err(PlanError::TooFewFree { found: free.len(), wanted });
    }
    let validation = free.split_off(free.len() - validation_poses);
    // Where the drawing puts them: a point that contradicts the base would have it sought elsewhere.
    let drawn = |q: &[f64]| world_from_tool(&cell.robot, &cell.base, &cell.tool, q).translation.vector;
    let samples = free.iter().enumerate().map(|(k, q)| Sample::new(k.to_string(), q.clone(), Measured::Point(drawn(q))));
    let design = PoolDesign::new(&cell, samples.collect(), vec![0; free.len()], &scenario.model)?;
    let best = |poses: usize| {
        let request = Request { starts: scenario.plan.starts, seed, ..Request::new(Quota::Free(poses)) };
        select(&design.candidates, &request)
    };
    let joints = |selection: &Selection| selection.poses.iter().map(|&p| free[p].clone()).collect::<Vec<_>>();
    let selection = best(identification_poses)?;
    let points = match scenario.plan.point_poses {
        0 => Vec::new(),
        poses => joints(&best(poses)?),
    };
    let identification = joints(&selection);
    let request = way_request(&cell, &layout.without_artifact, seed);
    let [points, validation, identification] = match start {
        Some(start) => tours(request, start, [points, validation, identification])?,
        None => [points, validation, identification].map(Tour::direct),
    };
    Ok(TrackerPlan { identification, chosen: design.chosen(&selection)?, points, validation })
}

/// The ways through three lists of postures, one after the other, from `start`.
fn tours(request: WayRequest<'_>, start: &[f64], lists: [Vec<Vec<f64>>; 3]) -> Result<[Tour; 3], WaysError> {
    let mut finder = WayFinder::new(request, start.to_vec());
    let mut blocked = Vec::new();
    let mut from = start.to_vec();
    let tours = lists.map(|poses| {
        let (tour, unreached) = through(&mut finder, &from, poses);
        blocked.extend(unreached.into_iter().map(|(k, why)| BlockedPose {
            pose: format!("tracker {}", k + 1),
            ball: None,
            why,
        }));
        if let Some(last) = tour.poses.last() {
            from.clone_from(last);
        }
        tour
    });
    if blocked.is_empty() { Ok(tours) } else { Err(WaysError::Blocked(blocked)) }
}

/// The ways through postures, one after the other, from `start`; those that cannot be reached, by their place, are left out.
fn through(finder: &mut WayFinder<'_>, start: &[f64], poses: Vec<Vec<f64>>) -> (Tour, Vec<(usize, Blocked)>) {
    let (mut tour, mut blocked) = (Tour::default(), Vec::new());
    for (k, pose) in poses.into_iter().enumerate() {
        let from = tour.poses.last().map_or(start, Vec::as_slice);
        match finder.stands(&pose).and_then(|()| finder.from_to(from, &pose)) {
            Ok(way) => {
                tour.via.push(way.via);
                tour.poses.push(pose);
            }
            Err(why) => blocked.push((k, why)),
        }
    }
    (tour, blocked)
}

/// The ways from `start` through postures where the artifact has been taken away, and which of them, by their place, cannot be reached.
pub fn tour_without_artifact(scenario: &Scenario, seed: u64, start: &[f64], poses: Vec<Vec<f64>>) -> (Tour, Vec<usize>) {
    let (cell, surroundings) = (scenario.dataset(), scenario.surroundings_without_artifact());
    let mut finder = WayFinder::new(way_request(&cell, &surroundings, seed), start.to_vec());
    let (tour, blocked) = through(&mut finder, start, poses);
    (tour, blocked.into_iter().map(|(k, _)| k).collect())
}

/// The way out of a ball, in the tool's axes: the middle of the three channels.
pub fn retreat() -> Unit<Vector3<f64>> {
    Unit::new_normalize(Vector3::repeat(1.0))
}

/// The cell of a scenario, for whoever is to find postures in it.
pub fn layout(scenario: &Scenario) -> CellLayout {
    CellLayout {
        surroundings: scenario.surroundings(),
        without_artifact: scenario.surroundings_without_artifact(),
        outward: scenario.outward().to_vec(),
        bodies: scenario.ball_ids().iter().map(|id| ball_body(id)).collect(),
        margins: Margins { clearance: scenario.plan.clearance_mm * MM, free: WAY_MARGIN, ..Margins::default() },
        retreat: scenario.plan.retreat_mm * MM,
        cone: scenario.plan.cone_deg * DEG,
        facing: Some(Facing {
            // The socket opens where a ball comes from; the reflector looks out of it.
            looks: -retreat(),
            tracker: Vector3::from(scenario.tracker.position_mm) * MM,
            within: scenario.tracker.facing_deg * DEG,
        }),
        is_known: true,
    }
}

/// The probings of a plan as samples that are where the drawing has them: a minute each, coming from any side.
pub fn as_drawn(scenario: &Scenario, poses: &[PlannedPose], seed: u64) -> Dataset {
    const CENTRING_S: f64 = 60.0;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut sides: BTreeMap<&str, Vec<i8>> = BTreeMap::new();
    let mut samples = Vec::new();
    for (k, pose) in poses.iter().filter(|p| !p.reserve).enumerate() {
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
            ..Sample::new(&*pose.id, pose.contact.clone(), Measured::Ball { ball: pose.ball, reading: Some(Vector3::zeros()) })
        });
    }
    Dataset { samples, ..scenario.dataset() }
}

/// The model without the effects that need what these samples do not hold: of poses in a pool nothing is known but joints and ball, not
/// when they will be measured nor from which side.
pub fn shown(model: &Model, dataset: &Dataset) -> Model {
    let balls = dataset.ball_ids();
    let subject = model.subject(&dataset.robot, &balls);
    let shows =
        |id: &String| effects::build(id, &subject).map_or(true, |e| missing(e.as_ref(), dataset, model, Use::Fit).is_none());
    Model { effects: model.effects.iter().filter(|id| shows(id)).cloned().collect(), ..model.clone() }
}

/// A pool seen through the model: what it can tell apart, and each pose's part in it.
pub(crate) struct PoolDesign {
    parameters: Vec<String>,
    jacobian: DMatrix<f64>,
    candidates: Candidates,
}

impl PoolDesign {
    pub(crate) fn new(cell: &Dataset, samples: Vec<Sample>, groups: Vec<usize>, model: &Model) -> Result<Self, PlanError> {
        // Only what is flat in the model counts: certified balls and tools are known.
        let mut certain = Dataset { samples, tool_sigma: 0.0, ..cell.clone() };
        certain.balls.iter_mut().for_each(|b| b.sigma = 0.0);
        let problem = Problem::new(&[("pool", &certain)], &shown(model, &certain), Use::Fit)?;
        let kept = independent_parameters(&problem)?;
        let jacobian = problem.plain_jacobian(&problem.start(), &kept);
        let row_major: Vec<f64> = jacobian.transpose().iter().copied().collect();
        let candidates = Candidates::new(&row_major, kept.len(), groups)?;
        let parameters = kept.iter().map(|&p| problem.parameters()[p].name.clone()).collect();
        Ok(PoolDesign { parameters, jacobian, candidates })
    }

    /// What a selection is made from.
    pub(crate) fn candidates(&self) -> &Candidates {
        &self.candidates
    }

    fn chosen(&self, selection: &Selection) -> Result<Chosen, PlanError> {
        let poses = &selection.poses;
        let rows =
            DMatrix::from_fn(3 * poses.len(), self.parameters.len(), |r, c| self.jacobian[(3 * poses[r / 3] + r % 3, c)]);
        Ok(Chosen {
            pool: self.jacobian.nrows() / 3,
            parameters: self.parameters.clone(),
            observability: observability_of(&rows, poses.len())?,
            starts: selection.starts.iter().map(|s| s.o1).collect(),
        })
    }
}
