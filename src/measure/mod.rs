//! Taking the data: mastering, the centring controller, the pool of poses, their selection, the campaign, the dataset.

mod dataset;
mod draws;
mod free_poses;
mod pool;

pub use dataset::{Anchor, Ball, BallDistance, DEFAULT_GRAVITY, Dataset, Measured, Noise, Sample, SampleSet};
pub use draws::{Margins, PoolError, Refusals};
pub use free_poses::{Facing, FreePosesRequest, free_poses};
pub use pool::{Candidate, PoolRequest, ProbedBall, feasible_pool};
