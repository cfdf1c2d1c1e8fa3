//! Which key of a scenario is to blame when a stage of the procedure cannot be completed.

use calibench::files::FileError;
use calibench::measure::PoolError;
use calibench::measure::selection::SelectionError;

use crate::planning::PlanError;
use crate::plant::PlantError;
use crate::run::RunError;
use crate::scenario::Scenario;
use crate::session::SessionError;
use crate::tracker::TrackerError;

const FEWER_PARAMETERS: &str = "take effects that these poses can show";

impl Scenario {
    /// Puts a failure of the planning at a key of this scenario, with what can be done about it.
    pub fn blame_plan(&self, error: &PlanError) -> FileError {
        self.blame_poses(error, "plan.poses_per_ball")
    }

    fn blame_poses(&self, error: &PlanError, poses: &str) -> FileError {
        let ball = |k: usize| format!("ball[{k}]");
        match error {
            PlanError::Tracker(inner) => self.blame_poses(inner, "tracker.identification_poses"),
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
                let remedy = "move the tracker, widen tracker.facing_deg, clear the cell, or ask for fewer poses";
                self.wrong("tracker", error.to_string(), remedy)
            }
            PlanError::Selection(SelectionError::TooFewCandidates { group, wanted, available })
                if poses == "plan.poses_per_ball" =>
            {
                let problem = format!("{available} postures were found that can probe it, where {wanted} are wanted");
                self.wrong(&ball(*group), problem, "give it more room, or lower plan.poses_per_ball")
            }
            PlanError::Selection(SelectionError::TooFewCandidates { .. } | SelectionError::TooFewPoses { .. }) => {
                self.wrong(poses, error.to_string(), "change the number of poses, or take a smaller model")
            }
            PlanError::Selection(_) | PlanError::Problem(_) | PlanError::Fit(_) => {
                self.wrong("model.effects", error.to_string(), FEWER_PARAMETERS)
            }
        }
    }

    fn blame_plant(&self, error: &PlantError) -> FileError {
        match error {
            PlantError::Unsuited { key, problem, remedy } => self.wrong(key, problem, remedy),
            PlantError::Absent { .. } => self.wrong("plant", error.to_string(), "or take the analytic plant"),
            PlantError::Restless { .. } => self.wrong("truth", error.to_string(), "make what is truly wrong smaller"),
        }
    }

    /// Puts a failure of the procedure at a key of this scenario, with what can be done about it.
    pub fn blame(&self, error: &RunError) -> FileError {
        let problem = with_reasons(error);
        match error {
            RunError::Plan(error) => self.blame_plan(error),
            RunError::Session(SessionError::Plant(error)) => self.blame_plant(error),
            RunError::Session(SessionError::Mastering(_)) => {
                self.wrong("truth.indicators", problem, "make the flaws of the indicators smaller")
            }
            RunError::Campaign(_) => self.wrong("truth", problem, "make what is truly wrong smaller, or retreat further"),
            RunError::Identify(_) | RunError::Task(_) => self.wrong("model.effects", problem, FEWER_PARAMETERS),
            RunError::Tracker(TrackerError::NestsInLine { .. }) => {
                self.wrong("tracker.nests_mm", problem, "spread the three nests")
            }
            RunError::Robot(_) => self.wrong("tracker", problem, "make what is truly wrong smaller"),
        }
    }
}

/// An error with the chain of its reasons.
pub fn with_reasons(error: &dyn std::error::Error) -> String {
    let mut message = error.to_string();
    let mut reason = error.source();
    while let Some(inner) = reason {
        message.push_str(&format!(": {inner}"));
        reason = inner.source();
    }
    message
}
