//! The postures in which an instrument measures points of a real cell: chosen by observability, reached by clear ways.

use calibench::cell::guards::Guards;
use calibench::identify::Model;
use calibench::measure::dataset::{Dataset, Measured, Sample};
use calibench::measure::poses::free_poses::{Facing, FreePosesRequest, free_poses};
use calibench::measure::poses::pool::Margins;
use calibench::measure::poses::selection::{Quota, Request, select};
use calibench::measure::poses::ways::{HomeWays, WAY_MARGIN, WayRequest, WaysError, plan_ways};
use calibench::measure::poses::{PlannedPose, ProbingPlan, interleave_short};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::solids::Surroundings;
use nalgebra::{Unit, Vector3};

use super::error::PlanError;
use super::pool_design::PoolDesign;
use super::{MOST_LEFT_OUT, Plan};
use crate::scenario::TRACKER_POOL;

/// A request for postures in which points are measured.
#[derive(Debug, Clone, Copy)]
pub struct PointRequest<'a> {
    /// The cell: robot, base, tool, payloads.
    pub cell: &'a Dataset,
    /// The bodies around the arm.
    pub bodies: &'a Surroundings,
    /// Limits on the robot's motions.
    pub guards: &'a Guards,
    /// Where the instrument is and which way its target looks, if it must be seen.
    pub facing: Option<Facing>,
    /// The model to identify.
    pub model: &'a Model,
    /// Number of postures.
    pub poses: usize,
    /// Starts of the search.
    pub starts: usize,
    /// Seed.
    pub seed: u64,
}

/// Chooses postures, and finds the ways of the arm through them.
///
/// # Errors
/// If too few postures are free, or cannot be reached, or do not determine the model.
pub fn plan_points(request: &PointRequest<'_>) -> Result<Plan, PlanError> {
    let PointRequest { cell, bodies, guards, poses: wanted, seed, .. } = *request;
    let mut free = free_poses(&FreePosesRequest {
        robot: &cell.robot,
        base: &cell.base,
        tool: &cell.tool,
        surroundings: bodies,
        margins: Margins { free: WAY_MARGIN, ..Margins::default() },
        facing: request.facing,
        count: TRACKER_POOL.max(2 * wanted),
        seed,
    })?;
    free.retain(|q| guards.joint_motion(q, q).is_ok());
    let mut left_out = 0;
    loop {
        if free.len() < wanted {
            return Err(PlanError::TooFewFree { found: free.len(), wanted });
        }
        let mut plan = chosen(request, &free)?;
        let ways = WayRequest { guards: Some(guards), ..WayRequest::of(cell, bodies, seed) };
        // No gauge is mastered; the direction of its socket does not matter.
        match plan_ways(ways, &[], &Unit::new_normalize(Vector3::z()), &mut plan.probing.poses) {
            Ok(ways) => {
                plan.probing.ways = Some(HomeWays { mastering: None, ..ways });
                return Ok(plan);
            }
            Err(WaysError::Blocked(blocked)) if left_out < MOST_LEFT_OUT => {
                let unreached =
                    |q: &Vec<f64>| plan.probing.poses.iter().any(|p| p.contact == *q && blocked.iter().any(|b| b.pose == p.id));
                let before = free.len();
                free.retain(|q| !unreached(q));
                left_out += before - free.len();
            }
            Err(why) => return Err(why.into()),
        }
    }
}

/// The best postures of a pool (rad, N), in an order that makes the tour short.
fn chosen(request: &PointRequest<'_>, free: &[Vec<f64>]) -> Result<Plan, PlanError> {
    let PointRequest { cell, .. } = *request;
    // Nominal positions: a point that contradicts the base would shift the estimate of the base.
    let nominal = |q: &[f64]| world_from_tool(&cell.robot, &cell.base, &cell.tool, q).translation.vector;
    let samples = free.iter().enumerate().map(|(k, q)| Sample::new(k.to_string(), q.clone(), Measured::Point(nominal(q))));
    let design = PoolDesign::new(cell, samples.collect(), vec![0; free.len()], request.model)?;
    let search = Request { starts: request.starts, seed: request.seed, ..Request::new(Quota::Free(request.poses)) };
    let selection = select(design.candidates(), &search)?;
    let poses: Vec<PlannedPose> = selection.poses.iter().map(|&p| point_pose(&free[p])).collect();
    let order = interleave_short(&poses);
    let named = |(k, &p): (usize, &usize)| PlannedPose { id: format!("t{:03}", k + 1), ..poses[p].clone() };
    let poses = order.iter().enumerate().map(named).collect();
    Ok(Plan { probing: ProbingPlan { poses, ways: None }, chosen: design.chosen(&selection)? })
}

/// A pose at which a point is measured, at these joints, rad (N).
fn point_pose(q: &[f64]) -> PlannedPose {
    PlannedPose {
        id: String::new(),
        ball: None,
        payload: 0,
        contact: q.to_vec(),
        approach: q.to_vec(),
        reserve: false,
        reverses: None,
        via: Vec::new(),
        clearance: None,
    }
}
