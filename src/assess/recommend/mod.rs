//! Recommendation of a model, from its predictions at postures that were not fitted.
//!
//! The effects of the catalogue name causes; the error curves of all joints only correct errors. They are Fourier
//! series in every joint's angle, each band of orders regularised by the size that the evidence gives it. Each choice
//! is compared with the first model on the same postures, pair by pair.

mod choices;
mod curves;
mod folds;
mod linear;
mod rule;
mod shrinkage;
mod steps;

pub use choices::{Choice, Kind, Recommendation, recommend};
pub(super) use curves::{bands, curve_model, shrunk};
pub use folds::Division;
pub(super) use folds::{postures, random_folds};
pub use rule::Gain;
pub(super) use steps::{gains, gains_of_each};

use super::examination::Examination;
use crate::measure::Dataset;

/// Place of each sample's ball, counted from 0; `None` if some sample has none, or there is only one place.
pub(super) fn places(examination: &Examination, datasets: &[(&str, &Dataset)]) -> Option<Vec<usize>> {
    let places: Option<Vec<usize>> = linear::places(examination, datasets).into_iter().collect();
    places.filter(|p| p.iter().any(|&place| place > 0))
}
