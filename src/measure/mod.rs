//! Taking the data: mastering, the centring controller, the pool of poses, their selection, the campaign, the dataset.

mod dataset;
mod pool;

pub use dataset::{Anchor, Ball, BallDistance, DEFAULT_GRAVITY, Dataset, Measured, Noise, Sample, SampleSet};
pub use pool::{
    Candidate, Facing, FreePosesRequest, Margins, PoolError, PoolRequest, ProbedBall, Refusals, feasible_pool, free_poses,
};
