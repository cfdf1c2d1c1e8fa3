//! The entries of a journal.

use serde::{Deserialize, Serialize};

use super::Conditions;
use crate::measure::campaign::mastering::Mastering;
use crate::measure::centring::Probing;
use crate::measure::dataset::{Measured, Sample};
use crate::measure::poses::PlannedPose;

/// A line of a journal after its first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Entry {
    Session(JournalSession),
    Probing(ProbingEntry),
    /// Conditions changed deliberately: the campaign continues under these.
    Conditions(Conditions),
}

/// The cell was made ready, at the beginning or after an interruption.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalSession {
    /// Number of the session in the dataset, counted from 1: its rows share one base and one tool. It does not change after an
    /// interruption in which neither the robot's foot, nor the artifact, nor the gauge on its flange was touched.
    pub number: usize,
    /// Wall-clock time, seconds since 1970 (UTC); `None` in a simulated cell, where no such time passes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_clock_s: Option<f64>,
    /// Version of the program.
    pub program: String,
    /// The mastering in use.
    pub mastering: Mastering,
    /// True if it is the mastering of the preceding line, found to be still valid.
    pub mastering_kept: bool,
}

impl JournalSession {
    /// The first session, just mastered, in a cell without a wall clock.
    pub fn first(mastering: Mastering) -> Self {
        let program = env!("CARGO_PKG_VERSION").into();
        JournalSession { number: 1, wall_clock_s: None, program, mastering, mastering_kept: false }
    }

    /// Name in samples: the first session has none, so that a campaign without interruption is a plain dataset.
    pub(super) fn name(&self) -> Option<String> {
        (self.number > 1).then(|| self.number.to_string())
    }
}

/// A finished probing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProbingEntry {
    /// Name of the planned pose.
    pub pose: String,
    /// Attempt, counted from 1.
    pub attempt: usize,
    /// Its result.
    pub probing: Probing,
    /// Sign of each joint's last motion when last on the ball; empty if never there.
    pub approach: Vec<i8>,
    /// Sign of each plunger's last motion.
    pub plungers: Vec<i8>,
}

impl ProbingEntry {
    /// The sample of the dataset, if the ball was centred.
    pub(crate) fn sample(&self, pose: &PlannedPose, session: Option<String>) -> Option<Sample> {
        let (centred, ball) = (self.probing.outcome.as_ref().ok()?, pose.ball?);
        Some(Sample {
            payload: pose.payload,
            session,
            time_s: Some(centred.time_s),
            temp_c: centred.temp_c,
            q_commanded: centred.commanded.clone(),
            tau: centred.torques.clone(),
            approach: Some(self.approach.clone()),
            plungers: <[i8; 3]>::try_from(self.plungers.as_slice()).ok(),
            ..Sample::new(&pose.id, centred.joints.clone(), Measured::Ball { ball, reading: Some(centred.reading) })
        })
    }
}
