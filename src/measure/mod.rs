//! Data acquisition: mastering, the centring controller, the pool of poses, their selection, the campaign, the dataset.

mod blocks;
mod campaign;
mod campaign_files;
mod campaign_record;
mod campaign_state;
mod cell_devices;
mod cell_file;
mod cell_toml;
mod centring;
mod centring_failure;
mod clock_jump;
mod columns;
mod conditions;
mod dataset;
mod dataset_file;
mod dataset_toml;
mod draws;
mod final_approach;
mod free_poses;
mod journal;
mod journal_entry;
mod journal_lines;
mod journal_place;
mod last_motion;
mod limits;
mod mastering;
mod order;
mod parts;
mod plan_file;
mod pool;
mod postures;
mod probing;
mod queue;
mod reading;
mod repeatability;
mod response;
mod samples_file;
mod samples_header;
#[cfg(feature = "schema")]
mod samples_schema;
mod samples_text;
pub mod selection;
mod ways;

pub use campaign::{Campaign, CampaignObserver, CampaignSettings, Progress};
pub use campaign_record::{Abort, CampaignRecord, ProbingRecord};
#[cfg(feature = "schema")]
pub(crate) use cell_file::cell_schema;
pub use cell_file::{CELL_FORMAT, Cell, read_cell};
pub use centring::{CenteringController, Centred, CentringSettings, Iteration, Phase};
pub use centring_failure::{CentringFailure, Suspicion};
pub use clock_jump::{ClockJump, LongSession};
pub(crate) use columns::{Column, of_other_kind};
pub use conditions::Conditions;
pub use dataset::{Anchor, Ball, BallDistance, Dataset, Measured, Noise, Orientation, Sample, SampleSet, Shared, ToolTarget};
pub(crate) use dataset_file::Reading;
pub use dataset_file::{DATASET_TOML, check_description, read_dataset, read_description, write_dataset};
pub(crate) use dataset_toml::DatasetToml;
#[cfg(feature = "schema")]
pub(crate) use dataset_toml::dataset_schema;
pub use draws::{Margins, PoolError, Refusals};
pub use free_poses::{Facing, FreePosesRequest, free_poses};
pub use journal::{Journal, OpenedJournal, journal_path};
pub use journal_entry::{JournalSession, ProbingEntry};
pub use journal_place::refuse_measured;
pub use last_motion::LastMotion;
pub(crate) use limits::{TEMPERATURE_C, TIME_S, out_of_range};
pub use mastering::{Attendant, CalledOff, Mastering, MasteringError, MasteringSettings, master, still_mastered};
pub use order::{interleave, interleave_short};
pub use parts::{Part, parts_by_payload};
#[cfg(feature = "schema")]
pub(crate) use plan_file::plan_schema;
pub use plan_file::{PLAN_FORMAT, ProbingPlan, read_plan, write_plan};
pub use pool::{Candidate, PoolRequest, ProbedBall, feasible_pool};
pub use postures::{Postures, SAME_POSTURE};
pub use probing::{PlannedPose, Probing, ProbingFailure};
pub use repeatability::{RepeatabilitySettings, Return, Reversal, Station, StationRecord};
pub(crate) use samples_file::Row;
pub(crate) use samples_header::Header;
#[cfg(feature = "schema")]
pub(crate) use samples_schema::samples_schema;
pub(crate) use samples_text::number;
pub use ways::{
    ArmAt, Blocked, BlockedPose, HomeWays, WAY_MARGIN, Way, WayFinder, WayRequest, WaysError, Whereabouts, plan_ways, turn,
    whereabouts,
};
