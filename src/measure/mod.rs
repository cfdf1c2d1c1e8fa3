//! Taking the data: mastering, the centring controller, the pool of poses, their selection, the campaign, the dataset.

mod columns;
mod dataset;
mod dataset_file;
mod dataset_folder;
mod samples_file;

pub use dataset::{Anchor, Ball, BallDistance, DEFAULT_GRAVITY, Dataset, Measured, Noise, Sample, SampleSet};
pub use dataset_file::{read_dataset, write_dataset};
