//! Errors of planning a scenario.

use calibench::identify::fit::FitError;
use calibench::identify::problem::ProblemError;
use calibench::measure::poses::pool::PoolError;
use calibench::measure::poses::selection::SelectionError;
use calibench::measure::poses::ways::WaysError;
use thiserror::Error;

/// Reasons why no plan was found.
#[derive(Debug, Error)]
pub enum PlanError {
    /// A ball cannot be probed, or there is no free space.
    #[error(transparent)]
    Pool(#[from] PoolError),
    /// The tracker sees too little of the free space.
    #[error("{found} postures are free of collision and face the tracker, where {wanted} are required")]
    TooFewFree {
        /// Postures found.
        found: usize,
        /// Postures required, for identification and validation together.
        wanted: usize,
    },
    /// No poses for the tracker were found.
    #[error("no poses for the tracker")]
    Tracker(#[source] Box<PlanError>),
    /// The selection failed.
    #[error(transparent)]
    Selection(#[from] SelectionError),
    /// The arm cannot reach the poses, or move from one to the next.
    #[error(transparent)]
    Ways(#[from] WaysError),
    /// Model and cell do not match.
    #[error(transparent)]
    Problem(#[from] ProblemError),
    /// The pool does not determine the model.
    #[error(transparent)]
    Fit(#[from] FitError),
}
