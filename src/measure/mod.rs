//! Taking the data: mastering, the centring controller, the pool of poses, their selection, the campaign, the dataset.

mod campaign;
mod campaign_files;
mod centring;
mod centring_failure;
mod dataset;
mod last_motion;
mod mastering;
mod order;
mod probing;
mod reading;
mod response;

pub use campaign::{Abort, Campaign, CampaignRecord, CampaignSettings, ProbingRecord, Progress, Witness};
pub use centring::{CenteringController, Centred, CentringSettings, Iteration, Phase};
pub use centring_failure::{CentringFailure, Suspicion};
pub use dataset::{Anchor, Ball, BallDistance, DEFAULT_GRAVITY, Dataset, Measured, Noise, Sample, SampleSet};
pub use mastering::{Attendant, CalledOff, Mastering, MasteringError, MasteringSettings, master};
pub use order::interleave;
pub use probing::{PlannedPose, Probing, ProbingFailure};
