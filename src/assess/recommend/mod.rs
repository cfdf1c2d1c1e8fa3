//! One recommendation: which model to use, decided by what it predicts at postures that were not fitted.
//!
//! The catalogue names causes, the error curves of all joints correct: Fourier series in every joint's angle, each band of orders held to
//! the size that the evidence gives it. A choice is compared with the model to begin with on the same postures, pair by pair.

mod choices;
mod curves;
mod folds;
mod linear;
mod rule;
mod shrinkage;
mod steps;

pub use choices::{Choice, Kind, Recommendation, recommend};
pub use folds::Division;
pub(super) use folds::{postures, random_folds};
pub use rule::Gain;
pub(super) use steps::{gains, gains_of_each};

use super::examination::Examination;
use crate::measure::Dataset;

/// Place of each sample's ball, counted from 0; `None` where some sample has none, or there is only one.
pub(super) fn places(examination: &Examination, datasets: &[(&str, &Dataset)]) -> Option<Vec<usize>> {
    let places: Option<Vec<usize>> = linear::places(examination, datasets).into_iter().collect();
    places.filter(|p| p.iter().any(|&place| place > 0))
}
