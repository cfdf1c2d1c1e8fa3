//! The plan of a scenario: a pool of feasible poses, the selected ones, and the poses for the tracker.

use calibench::identify::{
    FitError, Model, Observability, Problem, ProblemError, Use, independent_parameters, observability_of,
};
use calibench::measure::selection::{Candidates, Quota, Request, Selection, SelectionError, select};
use calibench::measure::{
    Dataset, Facing, FreePosesRequest, Margins, Measured, PlannedPose, PoolError, PoolRequest, ProbedBall, Sample,
    feasible_pool, free_poses, interleave,
};
use calibench::robot::Surroundings;
use calibench::units::{DEG, MM};
use nalgebra::{DMatrix, Unit, Vector3};
use thiserror::Error;

use crate::scenario::{Order, Scenario, TrackerPlace, ball_body};

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
    /// Probings, in their order; reserves after them.
    pub probings: Vec<PlannedPose>,
    /// How they were chosen.
    pub trical: Chosen,
}

impl Plan {
    /// Number of probings wanted, reserves not counted.
    pub fn wanted(&self) -> usize {
        wanted(&self.probings)
    }
}

/// Number of poses that are not reserves.
pub fn wanted(poses: &[PlannedPose]) -> usize {
    poses.iter().filter(|p| !p.reserve).count()
}

/// Joint targets for the tracker.
#[derive(Debug, Clone)]
pub struct TrackerPlan {
    /// For identification, chosen by observability; rad.
    pub identification: Vec<Vec<f64>>,
    /// How they were chosen.
    pub chosen: Chosen,
    /// For validation, at random; rad.
    pub validation: Vec<Vec<f64>>,
}

/// Poses to select from when the tracker measures: spread over the whole workspace.
pub const TRACKER_POOL: usize = 2000;

/// Chooses the probings of a scenario.
///
/// # Errors
/// When a ball cannot be probed or the pool does not determine the model.
pub fn plan(scenario: &Scenario, seed: u64) -> Result<Plan, PlanError> {
    let cell = scenario.dataset();
    let balls: Vec<ProbedBall> = cell
        .balls
        .iter()
        .zip(scenario.outward())
        .map(|(b, outward)| ProbedBall { id: b.id.clone(), centre: b.position, outward, body: Some(ball_body(&b.id)) })
        .collect();
    let pool = feasible_pool(&PoolRequest {
        robot: &cell.robot,
        base: &cell.base,
        tool: &cell.tool,
        balls: &balls,
        approach: retreat(),
        approach_length: scenario.plan.retreat_mm * MM,
        cone: scenario.plan.cone_deg * DEG,
        surroundings: &scenario.surroundings(),
        margins: margins(scenario),
        count_per_ball: scenario.plan.pool_per_ball,
        seed,
    })?;
    let samples = pool
        .iter()
        .enumerate()
        .map(|(k, c)| Sample::new(k.to_string(), c.q.clone(), Measured::Ball { ball: c.ball, reading: None }));
    let groups: Vec<usize> = pool.iter().map(|c| c.ball).collect();
    let per_ball = |poses: usize| Quota::PerGroup(vec![poses; cell.balls.len()]);
    let model = scenario.model();
    let pool_design = PoolDesign::new(&cell, samples.collect(), groups, &model)?;
    let request = Request { starts: scenario.plan.starts, seed, ..Request::new(per_ball(scenario.plan.poses_per_ball)) };
    let selection = select(&pool_design.candidates, &request)?;
    let trical = pool_design.chosen(&selection)?;
    let with_reserves = Request {
        fixed: selection.poses.clone(),
        starts: 1,
        seed,
        ..Request::new(per_ball(scenario.plan.poses_per_ball + scenario.plan.reserves_per_ball))
    };
    let reserves = select(&pool_design.candidates, &with_reserves)?.poses.into_iter().filter(|p| !selection.poses.contains(p));
    let pose = |id: String, p: usize, reserve: bool| PlannedPose {
        id,
        ball: pool[p].ball,
        payload: 0,
        contact: pool[p].q.clone(),
        approach: pool[p].q_approach.clone(),
        reserve,
    };
    let poses: Vec<PlannedPose> =
        selection.poses.iter().enumerate().map(|(k, &p)| pose(format!("p{:02}", k + 1), p, false)).collect();
    let reserves = reserves.enumerate().map(|(k, p)| pose(format!("r{:02}", k + 1), p, true));
    let order = match scenario.plan.order {
        Order::Interleaved => interleave(&poses),
        Order::BallByBall => (0..poses.len()).collect(),
    };
    Ok(Plan { probings: order.into_iter().map(|k| poses[k].clone()).chain(reserves).collect(), trical })
}

/// Chooses the tracker's poses.
///
/// # Errors
/// When there is no free space that the tracker sees.
pub fn plan_tracker(scenario: &Scenario, seed: u64) -> Result<TrackerPlan, PlanError> {
    let cell = scenario.dataset();
    // The artifact is removed before the tracker measures (paper, section 6); the table stays.
    let Surroundings { mut fixed, carried } = scenario.surroundings();
    fixed.retain(|s| !on_artifact(&s.name));
    let surroundings = Surroundings { fixed, carried };
    let mut free = free_poses(&FreePosesRequest {
        robot: &cell.robot,
        base: &cell.base,
        tool: &cell.tool,
        surroundings: &surroundings,
        margins: margins(scenario),
        facing: Some(Facing {
            // The socket opens where a ball comes from; the reflector looks out of it.
            looks: -retreat(),
            tracker: Vector3::from(scenario.tracker.position_mm) * MM,
            within: scenario.tracker.facing_deg * DEG,
        }),
        count: TRACKER_POOL + scenario.tracker.validation_poses,
        seed,
    })?;
    let TrackerPlace { identification_poses, validation_poses, .. } = scenario.tracker;
    let wanted = identification_poses + validation_poses;
    if free.len() < wanted {
        return Err(PlanError::TooFewFree { found: free.len(), wanted });
    }
    let validation = free.split_off(free.len() - validation_poses);
    let samples =
        free.iter().enumerate().map(|(k, q)| Sample::new(k.to_string(), q.clone(), Measured::Point(Vector3::zeros())));
    let design = PoolDesign::new(&cell, samples.collect(), vec![0; free.len()], &scenario.model())?;
    let quota = Quota::Free(scenario.tracker.identification_poses);
    let selection = select(&design.candidates, &Request { starts: scenario.plan.starts, seed, ..Request::new(quota) })?;
    let chosen = design.chosen(&selection)?;
    let identification = selection.poses.iter().map(|&p| free[p].clone()).collect();
    Ok(TrackerPlan { identification, chosen, validation })
}

fn on_artifact(name: &str) -> bool {
    ["riser", "stem", "ball"].iter().any(|part| name.starts_with(part))
}

/// The way out of a ball, in the tool's axes: the middle of the three channels.
fn retreat() -> Unit<Vector3<f64>> {
    Unit::new_normalize(Vector3::repeat(1.0))
}

fn margins(scenario: &Scenario) -> Margins {
    Margins { clearance: scenario.plan.clearance_mm * MM, ..Margins::default() }
}

/// A pool seen through the model: what it can tell apart, and each pose's part in it.
struct PoolDesign {
    parameters: Vec<String>,
    jacobian: DMatrix<f64>,
    candidates: Candidates,
}

impl PoolDesign {
    fn new(cell: &Dataset, samples: Vec<Sample>, groups: Vec<usize>, model: &Model) -> Result<Self, PlanError> {
        // Only what is flat in the model counts: certified balls and tools are known.
        let mut certain = Dataset { samples, tool_sigma: 0.0, ..cell.clone() };
        certain.balls.iter_mut().for_each(|b| b.sigma = 0.0);
        let problem = Problem::new(&[("pool", &certain)], model, Use::Fit)?;
        let kept = independent_parameters(&problem)?;
        let jacobian = problem.plain_jacobian(&problem.start(), &kept);
        let row_major: Vec<f64> = jacobian.transpose().iter().copied().collect();
        let candidates = Candidates::new(&row_major, kept.len(), groups)?;
        let parameters = kept.iter().map(|&p| problem.parameters()[p].name.clone()).collect();
        Ok(PoolDesign { parameters, jacobian, candidates })
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
