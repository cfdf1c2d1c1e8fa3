//! Taking the data: mastering, the centring controller, the pool of poses, their selection, the campaign, the dataset.

mod columns;
mod dataset;
pub mod selection;

pub use campaign::{Abort, Campaign, CampaignRecord, CampaignSettings, ProbingRecord, Progress, Witness};
pub use centring::{CenteringController, Centred, CentringSettings, Iteration, Phase};
pub use centring_failure::{CentringFailure, Suspicion};
pub use dataset::{Anchor, Ball, BallDistance, DEFAULT_GRAVITY, Dataset, Measured, Noise, Sample, SampleSet};
pub use dataset_file::{read_dataset, write_dataset};
pub(crate) use columns::Column;
pub(crate) use dataset_file::{DatasetToml, Reading};
pub(crate) use samples_file::{Header, Row, number};
pub use mastering::{Attendant, CalledOff, Mastering, MasteringError, MasteringSettings, master};
pub use order::interleave;
pub use probing::{PlannedPose, Probing, ProbingFailure};
pub use draws::{Margins, PoolError, Refusals};
pub use free_poses::{Facing, FreePosesRequest, free_poses};
pub use plan_file::{PLAN_FORMAT, read_plan, write_plan};
pub use pool::{Candidate, PoolRequest, ProbedBall, feasible_pool};
