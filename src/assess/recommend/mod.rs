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
pub use rule::Gain;
pub(super) use steps::{gains, gains_of_each};

use super::examination::Examination;
use crate::identify::Circumstance;
use crate::measure::{Dataset, Postures};

/// Fold of each sample where whole postures are drawn at random.
pub(super) fn random_folds(circumstances: &[Circumstance]) -> Vec<usize> {
    let postures = postures(circumstances);
    let folds = folds::Folds::random(postures.count());
    postures.of_samples().iter().map(|&p| folds.of[p]).collect()
}

/// Place of each sample's ball, counted from 0; `None` where some sample has none, or there is only one.
pub(super) fn places(examination: &Examination, datasets: &[(&str, &Dataset)]) -> Option<Vec<usize>> {
    let places: Option<Vec<usize>> = linear::places(examination, datasets).into_iter().collect();
    places.filter(|p| p.iter().any(|&place| place > 0))
}

/// Postures of a campaign, whatever the set-up or the target: what the arm does is the same.
pub(super) fn postures(circumstances: &[Circumstance]) -> Postures {
    let joints: Vec<&[f64]> = circumstances.iter().map(|c| c.q.as_slice()).collect();
    Postures::of_joints(&joints, &vec![0; joints.len()])
}
