//! Poses to measure: a pool of feasible ones, the choice among them, their order, and the ways of the arm between them.

pub(crate) mod blocks;
mod draws;
pub mod free_poses;
mod order;
mod plan_file;
mod planned_pose;
pub mod pool;
mod postures;
pub(crate) mod queue;
pub mod selection;
pub mod ways;

pub use order::{interleave, interleave_short};
#[cfg(feature = "schema")]
pub(crate) use plan_file::plan_schema;
pub use plan_file::{PLAN_FORMAT, ProbingPlan, read_plan, write_plan};
pub use planned_pose::PlannedPose;
pub use postures::Postures;
