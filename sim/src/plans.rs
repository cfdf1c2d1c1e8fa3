//! All plans made before a session, and the approximate duration of the session.

use std::collections::BTreeSet;

use calibench::measure::poses::PlannedPose;
use calibench::units::DEG;

use crate::planning::{Plan, PlanError, TrackerPlan, plan, plan_tracker};
use crate::rival_poses::rival_poses;
use crate::scenario::Scenario;
use crate::world::{HANDLING_S, READING_S, REBUILDING_S};

/// Plans of a scenario: the same for all trials of a seed.
#[derive(Clone)]
pub struct Plans {
    /// The probings.
    pub plan: Plan,
    /// The tracker's poses.
    pub tracker: TrackerPlan,
    /// Joints (rad) at which distances are measured, and the index of the anchor; empty for an instrument that meets balls.
    pub rival: Vec<(usize, Vec<f64>)>,
}

impl Plans {
    /// Plans a scenario.
    ///
    /// # Errors
    /// When a ball cannot be probed, or the poses cannot determine the model.
    pub fn new(scenario: &Scenario, seed: u64) -> Result<Self, PlanError> {
        let plan = plan(scenario, seed)?;
        let home = plan.probing.ways.as_ref().map(|ways| ways.home.as_slice());
        let tracker = plan_tracker(scenario, seed, home).map_err(|e| PlanError::Tracker(Box::new(e)))?;
        Ok(Plans { plan, tracker, rival: rival_poses(scenario, seed)? })
    }

    /// Approximate duration of the fitted part, s.
    pub fn session_s(&self, scenario: &Scenario) -> f64 {
        session_s(scenario, &self.plan.probing.poses, self.tracker.points.poses.len())
    }
}

/// Stops of a probing: before it, on the ball, three steps, and back (a centring takes 3.5 readings on average).
const STOPS: f64 = 5.5;
/// The same where contacts are aimed: on the ball, a step or two, and back (docs/decisions/0057).
const STOPS_AIMED: f64 = 4.1;

/// Approximate time, s, to probe these poses and to measure this many points: the meaning of "by the end of the
/// session" in a truth.
pub fn session_s(scenario: &Scenario, poses: &[PlannedPose], points: usize) -> f64 {
    let controller = &scenario.truth().keys().controller;
    let speed = controller.speed_deg_per_s * DEG;
    let travel = |from: &[f64], to: &[f64]| from.iter().zip(to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / speed;
    let poses: Vec<&PlannedPose> = poses.iter().filter(|p| !p.reserve).collect();
    let ways: f64 = poses.windows(2).map(|pair| travel(&pair[0].approach, &pair[1].approach)).sum();
    let onto: f64 = poses.iter().map(|p| 2.0 * travel(&p.approach, &p.contact)).sum();
    let stops = if scenario.plan.aimed { STOPS_AIMED } else { STOPS };
    let probings = stops * (controller.settle_s + 3.0 * READING_S) * poses.len() as f64;
    // Between random postures a joint travels a third of its range on average, the longest travel of six about half; 0.3 of
    // the largest range is used here.
    let range = scenario.robot().links.iter().map(|l| l.limits[1] - l.limits[0]).fold(0.0, f64::max);
    let payloads: BTreeSet<usize> = poses.iter().map(|p| p.payload).collect();
    // The first payload is mounted again for the tracker, which needs the artifact removed.
    let changes = if payloads.len() > 1 { payloads.len() - usize::from(points == 0) } else { 0 };
    let rebuilding = REBUILDING_S * (changes + usize::from(points > 0)) as f64;
    let tracked = points as f64 * (0.3 * range / speed + controller.settle_s);
    2.0 * HANDLING_S + ways + onto + probings + rebuilding + tracked
}
