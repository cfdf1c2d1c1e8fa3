//! The arm: a chain of revolute and prismatic joints in modified DH with Hayati's beta, its masses, limits and solids.

mod arm;
mod builtin;
mod dexterity;
mod frame;
mod guessed_masses;
pub mod inverse;
pub mod kinematics;
mod link;
mod posture_view;
pub mod rel_tool;
pub mod robot_file;
mod scene_file;
pub mod sites;
pub mod solids;
mod spherical_wrist;
pub mod statics;
mod status_turn;
pub mod urdf;

pub use arm::Robot;
pub use builtin::{BUILT_IN, built_in};
pub use frame::{Frame, Vectors, rotation_vector};
pub(crate) use frame::{angle_between, apart};
pub(crate) use link::NEARLY_PARALLEL;
pub use link::{FramePose, JointKind, Link, MdhLink, Pose};
#[cfg(feature = "schema")]
pub(crate) use robot_file::robot_schema;
