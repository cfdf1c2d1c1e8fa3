//! The plan of a scenario: a pool of feasible poses, the selected ones, and the poses for the tracker.

use calibench::identify::{Model, Observability, Problem, ProblemError, Use, independent_parameters};
use calibench::identify::FitError;
use calibench::measure::{
    Candidates, Dataset, Measured, PlannedPose, PoolError, PoolRequest, Quota, Request, Sample, Selection, SelectionError, ball_pool,
    free_pool, interleave, select,
};
use calibench::robot::SiteIndex;
use calibench::robot::{Posture, Surroundings};
use calibench::units::{DEG, MM};
use nalgebra::{Unit, Vector3};
use thiserror::Error;

use crate::scenario::{Order, Scenario};

/// Why there is no plan.
#[derive(Debug, Error)]
pub enum PlanError {
    /// A ball cannot be probed, or there is no free space.
    #[error(transparent)]
    Pool(#[from] PoolError),
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
    /// Probings, in their order.
    pub probings: Vec<PlannedPose>,
    /// How they were chosen.
    pub trical: Chosen,
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
const TRACKER_POOL: usize = 2000;

/// Chooses the probings of a scenario.
///
/// # Errors
/// When a ball cannot be probed or the pool does not determine the model.
pub fn plan(scenario: &Scenario, seed: u64) -> Result<Plan, PlanError> {
    let cell = scenario.dataset();
    let surroundings = scenario.surroundings();
    let pool = ball_pool(&PoolRequest {
        robot: &cell.robot,
        base: &cell.base,
        tool: &cell.tool,
        balls: &cell.balls.iter().map(|b| b.position).collect::<Vec<_>>(),
        outward: &scenario.outward(),
        retreat: Unit::new_normalize(Vector3::repeat(1.0)),
        retreat_length: scenario.plan.retreat_mm * MM,
        cone: scenario.plan.cone_deg * DEG,
        clearance: scenario.plan.clearance_mm * MM,
        surroundings: &surroundings,
        count_per_ball: scenario.plan.pool_per_ball,
        seed,
    })?;
    let samples = pool.iter().enumerate().map(|(k, c)| {
        Sample::new(k.to_string(), c.contact.clone(), Measured::Ball { ball: c.ball, reading: None })
    });
    let groups: Vec<usize> = pool.iter().map(|c| c.ball).collect();
    let quota = Quota::PerGroup(vec![scenario.plan.poses_per_ball; cell.balls.len()]);
    let (selection, trical) = choose(&cell, samples.collect(), Some(&groups), quota, &scenario.model(), scenario.plan.starts, seed)?;
    let poses: Vec<PlannedPose> = selection
        .poses
        .iter()
        .enumerate()
        .map(|(k, &p)| PlannedPose {
            id: format!("p{:02}", k + 1),
            ball: pool[p].ball,
            payload: 0,
            contact: pool[p].contact.clone(),
            approach: pool[p].approach.clone(),
        })
        .collect();
    let order = match scenario.plan.order {
        Order::Interleaved => interleave(&poses),
        Order::BallByBall => (0..poses.len()).collect(),
    };
    Ok(Plan { probings: order.into_iter().map(|k| poses[k].clone()).collect(), trical })
}

/// Chooses the tracker's poses.
///
/// # Errors
/// When there is no free space that the tracker sees.
pub fn plan_tracker(scenario: &Scenario, seed: u64) -> Result<TrackerPlan, PlanError> {
    let cell = scenario.dataset();
    // The artifact is removed before the tracker measures (paper, section 6); the table stays.
    let fixed = scenario.surroundings().fixed.into_iter().filter(|s| !on_artifact(&s.name)).collect();
    let surroundings = Surroundings { fixed, ..scenario.surroundings() };
    let tracker = Vector3::from(scenario.tracker.position_mm) * MM;
    let mut posture = Posture::new(&cell.robot);
    let zero = vec![0.0; SiteIndex::new(cell.robot.joints()).len()];
    let facing = (scenario.tracker.facing_deg * DEG).cos();
    let mut sees = |q: &[f64]| {
        posture.set(&cell.robot, &cell.base, &cell.tool, q, &zero);
        let tool = posture.world_from_tool(&cell.tool);
        // The socket opens along -(1, 1, 1) of the tool, where a ball comes from; the reflector looks out of it.
        let outwards = -(tool.rotation * Vector3::repeat(1.0)).normalize();
        (tracker - posture.tcp()).normalize().dot(&outwards) > facing
    };
    let clearance = scenario.plan.clearance_mm * MM;
    let count = TRACKER_POOL + scenario.tracker.validation_poses;
    let mut free = free_pool(&cell.robot, &cell.base, &cell.tool, &surroundings, clearance, count, seed, &mut sees)?;
    let validation = free.split_off(TRACKER_POOL);
    let samples = free.iter().enumerate().map(|(k, q)| Sample::new(k.to_string(), q.clone(), Measured::Point(Vector3::zeros())));
    let quota = Quota::Free(scenario.tracker.identification_poses);
    let (selection, chosen) = choose(&cell, samples.collect(), None, quota, &scenario.model(), scenario.plan.starts, seed)?;
    let identification = selection.poses.iter().map(|&p| free[p].clone()).collect();
    Ok(TrackerPlan { identification, chosen, validation })
}

fn on_artifact(name: &str) -> bool {
    name.starts_with("riser") || name.starts_with("stem")
}

/// Selects by observability of what the pool can tell apart.
fn choose(
    cell: &Dataset,
    samples: Vec<Sample>,
    groups: Option<&[usize]>,
    quota: Quota,
    model: &Model,
    starts: usize,
    seed: u64,
) -> Result<(Selection, Chosen), PlanError> {
    // Only what is flat in the model counts: certified balls and tools are known.
    let mut certain = Dataset { samples, tool_sigma: 0.0, ..cell.clone() };
    certain.balls.iter_mut().for_each(|b| b.sigma = 0.0);
    let problem = Problem::new(&[("pool", &certain)], model, Use::Fit)?;
    let kept = independent_parameters(&problem)?;
    let jacobian = problem.plain_jacobian(&problem.start(), &kept);
    let candidates = Candidates::new(&jacobian, groups)?;
    let selection = select(&candidates, &Request { starts, seed, ..Request::new(quota) })?;
    let rows = nalgebra::DMatrix::from_fn(3 * selection.poses.len(), kept.len(), |r, c| jacobian[(3 * selection.poses[r / 3] + r % 3, c)]);
    let chosen = Chosen {
        pool: certain.samples.len(),
        parameters: kept.iter().map(|&p| problem.parameters()[p].name.clone()).collect(),
        observability: Observability::of_jacobian(&rows, selection.poses.len()).map_err(FitError::from)?,
        starts: selection.starts.iter().map(|s| s.o1).collect(),
    };
    Ok((selection, chosen))
}
