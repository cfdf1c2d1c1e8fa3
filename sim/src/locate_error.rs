//! Finds the key of a scenario that is responsible when a stage of the procedure cannot be completed.

use calibench::files::{FileError, with_reasons};
use calibench::measure::poses::pool::PoolError;
use calibench::measure::poses::selection::SelectionError;

use crate::mechanics::PlantError;
use crate::planning::PlanError;
use crate::run::RunError;
use crate::scenario::Scenario;
use crate::session::SessionError;
use crate::tracker::TrackerError;

const FEWER_PARAMETERS: &str = "take effects that these poses can show";

impl Scenario {
    /// Attributes a failure of the planning to a key of this scenario, with a remedy.
    pub fn locate_plan(&self, error: &PlanError) -> FileError {
        self.locate_poses(error, "plan.poses_per_ball")
    }

    fn locate_poses(&self, error: &PlanError, poses: &str) -> FileError {
        let ball = |k: usize| format!("ball[{k}]");
        match error {
            PlanError::Tracker(inner) => self.locate_poses(inner, "tracker.identification_poses"),
            PlanError::Pool(PoolError::NoPose { ball: id, .. } | PoolError::UnknownBody { ball: id, .. }) => {
                let key = self.ball_ids().iter().position(|b| b == id).map_or_else(|| "ball".into(), ball);
                let remedy = "move the ball or the base, turn its `outward`, widen plan.cone_deg, or lower plan.clearance_mm";
                self.wrong(&key, error.to_string(), remedy)
            }
            PlanError::Ways(_) => {
                let remedy = "clear the cell, move the artifact or the base, or lower plan.clearance_mm";
                self.wrong("solid", error.to_string(), remedy)
            }
            PlanError::Pool(PoolError::NoFreePose { .. }) | PlanError::TooFewFree { .. } => {
                let remedy = "move the tracker, widen tracker.facing_deg, clear the cell, or request fewer poses";
                self.wrong("tracker", error.to_string(), remedy)
            }
            PlanError::Selection(SelectionError::TooFewCandidates { group, requested, available })
                if poses == "plan.poses_per_ball" =>
            {
                let problem = format!("{available} postures were found that can probe it, where {requested} are required");
                self.wrong(&ball(*group), problem, "give it more room, or lower plan.poses_per_ball")
            }
            PlanError::Selection(SelectionError::TooFewCandidates { .. } | SelectionError::TooFewPoses { .. }) => {
                self.wrong(poses, error.to_string(), "change the number of poses, or take a smaller model")
            }
            PlanError::Pool(_) => self.wrong("plan", error.to_string(), "change the cell or the plan"),
            PlanError::Selection(_) | PlanError::Problem(_) | PlanError::Fit(_) => {
                self.wrong("model.effects", error.to_string(), FEWER_PARAMETERS)
            }
        }
    }

    fn locate_plant(&self, error: &PlantError) -> FileError {
        match error {
            PlantError::Unsuited { key, problem, remedy } => self.wrong(key, problem, remedy),
            PlantError::Absent { .. } => self.wrong("plant", error.to_string(), "or take the analytic plant"),
            PlantError::Restless { .. } => self.wrong("truth", error.to_string(), "make the injected errors smaller"),
        }
    }

    /// Attributes a failure of the procedure to a key of this scenario, with a remedy.
    pub fn locate(&self, error: &RunError) -> FileError {
        let problem = with_reasons(error);
        match error {
            RunError::Plan(error) => self.locate_plan(error),
            RunError::Session(SessionError::Plant(error)) => self.locate_plant(error),
            RunError::Session(SessionError::Mastering(_)) => {
                self.wrong("truth.indicators", problem, "make the flaws of the indicators smaller")
            }
            RunError::Campaign(_) => self.wrong("truth", problem, "make the injected errors smaller, or retreat further"),
            RunError::Identify(_) | RunError::Task(_) => self.wrong("model.effects", problem, FEWER_PARAMETERS),
            RunError::Tracker(TrackerError::NestsInLine { .. }) => {
                self.wrong("tracker.nests_mm", problem, "spread the three nests")
            }
            RunError::Robot(_) => self.wrong("tracker", problem, "make the injected errors smaller"),
        }
    }
}
