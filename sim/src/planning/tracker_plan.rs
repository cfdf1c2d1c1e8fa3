//! The poses measured by the tracker, and the paths through them.

use calibench::measure::dataset::{Dataset, Measured, Sample};
use calibench::measure::poses::free_poses::{FreePosesRequest, free_poses};
use calibench::measure::poses::selection::{Quota, Request, Selection, select};
use calibench::measure::poses::ways::{Blocked, BlockedPose, WayFinder, WayRequest, WaysError};
use calibench::planning::pool::CellLayout;
use calibench::robot::kinematics::world_from_tool;

use super::error::PlanError;
use super::layout::layout;
use super::pool_design::{Chosen, PoolDesign};
use crate::scenario::{Scenario, TRACKER_POOL, TrackerToml};

/// A sequence of postures and the paths between them.
#[derive(Debug, Clone, Default)]
pub struct Tour {
    /// The postures, rad.
    pub poses: Vec<Vec<f64>>,
    /// Intermediate joints on the path to each posture from the previous one (to the first from the arm's previous posture),
    /// rad; empty for a direct motion.
    pub via: Vec<Vec<Vec<f64>>>,
    /// True if no paths were planned: the arm moves directly from one posture to the next.
    pub has_no_ways: bool,
}

impl Tour {
    /// A tour of direct motions, without regard to obstacles.
    pub fn direct(poses: Vec<Vec<f64>>) -> Self {
        Tour { via: vec![Vec::new(); poses.len()], poses, has_no_ways: true }
    }
}

/// Joint targets for the tracker.
#[derive(Debug, Clone)]
pub struct TrackerPlan {
    /// For identification, chosen by observability.
    pub identification: Tour,
    /// The selection from which these result.
    pub chosen: Chosen,
    /// Added to the probings, chosen by observability.
    pub points: Tour,
    /// For validation, chosen at random.
    pub validation: Tour,
}

/// Chooses the tracker's poses, and finds the paths through them from the posture `start` (rad), if given.
///
/// # Errors
/// When the tracker sees no free space.
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
    for _ in 1..ATTEMPTS {
        match plan_of(scenario, &cell, &layout, seed, &free, start)? {
            Ok(plan) => return Ok(plan),
            // Poses that the arm cannot reach leave the pool, as those on balls do.
            Err(unreached) => free.retain(|q| unreached.iter().all(|u| u.joints != *q)),
        }
    }
    plan_of(scenario, &cell, &layout, seed, &free, start)?
        .map_err(|unreached| WaysError::Blocked(unreached.into_iter().map(|u| u.pose).collect()).into())
}

/// Attempts to plan, the last one with an error where a pose cannot be reached.
const ATTEMPTS: usize = 6;

/// A pose that the arm cannot reach, and its joints, rad (N).
struct Unreached {
    pose: BlockedPose,
    joints: Vec<f64>,
}

/// A plan of these free postures (rad, N), or those of its poses that cannot be reached.
fn plan_of(
    scenario: &Scenario,
    cell: &Dataset,
    layout: &CellLayout,
    seed: u64,
    free: &[Vec<f64>],
    start: Option<&[f64]>,
) -> Result<Result<TrackerPlan, Vec<Unreached>>, PlanError> {
    let TrackerToml { identification_poses, validation_poses, .. } = scenario.tracker;
    let wanted = identification_poses.max(scenario.plan.point_poses) + validation_poses;
    if free.len() < wanted {
        return Err(PlanError::TooFewFree { found: free.len(), wanted });
    }
    let (free, validation) = free.split_at(free.len() - validation_poses);
    // Nominal positions: a point that contradicts the base would shift the estimate of the base.
    let nominal = |q: &[f64]| world_from_tool(&cell.robot, &cell.base, &cell.tool, q).translation.vector;
    let samples = free.iter().enumerate().map(|(k, q)| Sample::new(k.to_string(), q.clone(), Measured::Point(nominal(q))));
    let design = PoolDesign::new(cell, samples.collect(), vec![0; free.len()], &scenario.model)?;
    let best = |poses: usize| {
        let request = Request { starts: scenario.plan.starts, seed, ..Request::new(Quota::Free(poses)) };
        select(design.candidates(), &request)
    };
    let joints = |selection: &Selection| selection.poses.iter().map(|&p| free[p].clone()).collect::<Vec<_>>();
    let selection = best(identification_poses)?;
    let points = match scenario.plan.point_poses {
        0 => Vec::new(),
        poses => joints(&best(poses)?),
    };
    let lists = [points, validation.to_vec(), joints(&selection)];
    let tours = match start {
        Some(start) => tours(WayRequest::of(cell, &layout.without_artifact, seed), start, lists),
        None => Ok(lists.map(Tour::direct)),
    };
    let chosen = design.chosen(&selection)?;
    Ok(tours.map(|[points, validation, identification]| TrackerPlan { identification, chosen, points, validation }))
}

/// The paths through three lists of postures in sequence, from `start`, or the postures that cannot be reached.
fn tours(request: WayRequest<'_>, start: &[f64], lists: [Vec<Vec<f64>>; 3]) -> Result<[Tour; 3], Vec<Unreached>> {
    let mut finder = WayFinder::new(request, start.to_vec());
    let mut blocked = Vec::new();
    let mut from = start.to_vec();
    let tours = lists.map(|poses| {
        let (tour, unreached) = through(&mut finder, &from, poses.clone());
        blocked.extend(unreached.into_iter().map(|(k, why)| Unreached {
            pose: BlockedPose { pose: format!("tracker {}", k + 1), ball: None, why },
            joints: poses[k].clone(),
        }));
        if let Some(last) = tour.poses.last() {
            from.clone_from(last);
        }
        tour
    });
    if blocked.is_empty() { Ok(tours) } else { Err(blocked) }
}

/// The paths through postures in sequence, from `start`; those that cannot be reached are omitted, and returned with
/// their index.
fn through(finder: &mut WayFinder<'_>, start: &[f64], poses: Vec<Vec<f64>>) -> (Tour, Vec<(usize, Blocked)>) {
    let (mut tour, mut blocked) = (Tour::default(), Vec::new());
    for (k, pose) in poses.into_iter().enumerate() {
        let from = tour.poses.last().map_or(start, Vec::as_slice);
        match finder.stands(&pose).and_then(|()| finder.to_any_turn(from, &pose)) {
            Ok((pose, way)) => {
                tour.via.push(way.via);
                tour.poses.push(pose);
            }
            Err(why) => blocked.push((k, why)),
        }
    }
    (tour, blocked)
}

/// The paths from `start` through postures with the artifact removed, and the indices of postures that cannot be reached.
pub fn tour_without_artifact(scenario: &Scenario, seed: u64, start: &[f64], poses: Vec<Vec<f64>>) -> (Tour, Vec<usize>) {
    let (cell, surroundings) = (scenario.dataset(), scenario.surroundings_without_artifact());
    let mut finder = WayFinder::new(WayRequest::of(&cell, &surroundings, seed), start.to_vec());
    let (tour, blocked) = through(&mut finder, start, poses);
    (tour, blocked.into_iter().map(|(k, _)| k).collect())
}
