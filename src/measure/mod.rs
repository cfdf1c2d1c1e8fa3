//! Taking the data: mastering, the centring controller, the pool of poses, their selection, the campaign, the dataset.

mod dataset;
pub mod selection;

pub use dataset::{Anchor, Ball, BallDistance, DEFAULT_GRAVITY, Dataset, Measured, Noise, Sample, SampleSet};
