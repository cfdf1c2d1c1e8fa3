//! The arm: a chain of revolute and prismatic joints in modified DH with Hayati's beta, its masses, limits and solids.

mod arm;
mod builtin;
mod dexterity;
mod frame;
mod inverse;
mod kinematics;
mod link;
mod posture_view;
mod rel_tool;
mod rigid_fit;
mod robot_file;
mod scene_file;
mod sites;
pub mod solids;
mod spherical_wrist;
mod statics;
mod status_turn;
mod urdf;

pub use arm::Robot;
pub use builtin::{BUILT_IN, built_in};
pub use dexterity::dexterity;
pub use frame::{Frame, Vectors, rotation_vector};
pub use inverse::{Chain, InverseKinematics, Kinematics, Outcome, Solution};
pub use kinematics::{BatchInput, Posture, Postures, world_from_tool};
pub use link::{FramePose, JointKind, Link, MdhLink, NEARLY_PARALLEL, Pose};
pub use posture_view::{LanePosture, PostureView};
pub(crate) use rel_tool::screw;
pub use rel_tool::{RelTool, RelToolError, rel_tool};
pub(crate) use rigid_fit::nearest_rotation;
pub use rigid_fit::rigid_fit;
#[cfg(feature = "schema")]
pub(crate) use robot_file::robot_schema;
pub use robot_file::{ROBOT_FORMAT, RobotReference, load_robot, robot, to_toml};
pub use sites::{Axis6, MOST_JOINTS, MdhEntry, Site, SiteIndex};
pub use solids::{Clearance, ClearanceCheck, Narrowest, Shape, Solid, Surroundings, SweptCheck, clearance};
pub use spherical_wrist::{Branch, NotSphericalWrist, SphericalWrist};
pub use statics::{DEFAULT_GRAVITY, Loads, LoadsBatch, Payload, Weights};
pub use status_turn::StatusTurn;
pub use urdf::{
    ChainEnds, JointOrigin, MissingMesh, UrdfRobot, calibrated_urdf, joint_origins, missing_meshes, robot_from_urdf,
};
