//! The results of a campaign.

use thiserror::Error;

use crate::measure::centring::{CentringFailure, Probing};
use crate::measure::dataset::Sample;

/// One probing of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbingRecord {
    /// Index of the pose in the plan.
    pub pose: usize,
    /// Attempt, counted from 1.
    pub attempt: usize,
    /// Its result.
    pub probing: Probing,
}

/// Reason why a campaign ended before its plan.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum Abort {
    /// The robot is lost or stopped.
    #[error("{0}")]
    Robot(CentringFailure),
    /// The arm could not be moved clear of a ball, so no path from there is known to be free.
    #[error("the arm could not be backed off: {0}")]
    NotBackedOff(CentringFailure),
    /// Too many poses in a row failed.
    #[error("{skipped} poses in a row failed, the last because: {last}")]
    TooManyFailures {
        /// Number of poses.
        skipped: usize,
        /// Failure of the last one.
        last: CentringFailure,
    },
    /// A probing could not be written to the journal, which contains all before it; or the journal belongs to another campaign.
    #[error("{why}")]
    NotJournalled {
        /// The error.
        why: String,
    },
}

/// The results of a campaign.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CampaignRecord {
    /// One sample for every pose centred, in the order measured.
    pub samples: Vec<Sample>,
    /// Every probing, in order.
    pub probings: Vec<ProbingRecord>,
    /// Reason why it ended early, if it did.
    pub aborted: Option<Abort>,
}

impl CampaignRecord {
    /// Mean number of readings (of three plungers) per centring.
    pub fn readings_mean(&self) -> f64 {
        let centred = self.probings.iter().filter_map(|p| p.probing.outcome.as_ref().ok());
        let readings: Vec<f64> = centred.map(|c| (c.steps + 1) as f64).collect();
        readings.iter().sum::<f64>() / readings.len().max(1) as f64
    }
}
