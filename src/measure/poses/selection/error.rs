//! Errors of a selection.

use thiserror::Error;

use crate::math::linalg::LinalgError;

/// Reason why there is no design.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum SelectionError {
    /// The sizes of the arrays do not match.
    #[error("{numbers} numbers are not 3 rows of {parameters} columns for each of {candidates} candidates")]
    Shape {
        /// Numbers given.
        numbers: usize,
        /// Groups given.
        candidates: usize,
        /// Columns requested.
        parameters: usize,
    },
    /// A row contains an infinity or NaN.
    #[error("column {column} of candidate {candidate} is not finite")]
    NotFinite {
        /// Index in the pool.
        candidate: usize,
        /// Parameter.
        column: usize,
    },
    /// No candidate is sensitive to this parameter.
    #[error("no candidate sees parameter {column}")]
    Unseen {
        /// Parameter.
        column: usize,
    },
    /// A group has fewer candidates than poses requested.
    #[error("{requested} poses are requested of group {group}, which has {available} candidates")]
    TooFewCandidates {
        /// Group; 0 if groups are ignored.
        group: usize,
        /// Poses requested.
        requested: usize,
        /// Candidates available.
        available: usize,
    },
    /// Fewer equations than parameters.
    #[error("{poses} poses give {} equations for {parameters} parameters", 3 * poses)]
    TooFewPoses {
        /// Poses requested.
        poses: usize,
        /// Parameters.
        parameters: usize,
    },
    /// A fixed candidate that cannot be kept.
    #[error("fixed candidate {candidate} is not in the pool, is named twice, or exceeds the quota of its group")]
    Fixed {
        /// Index in the pool.
        candidate: usize,
    },
    /// The best poses available cannot separate the parameters.
    #[error(
        "the poses found cannot distinguish all parameters (condition number {condition:.1e}); leave out what is redundant"
    )]
    NotIdentifiable {
        /// Condition number of the Jacobian of the poses, columns at equal scale.
        condition: f64,
    },
    /// A factorisation failed.
    #[error(transparent)]
    Linalg(#[from] LinalgError),
}
