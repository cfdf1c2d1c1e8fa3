//! Using a calibration: which joints put the tool where it is wanted, and what the robot's own controller must be told for that.
//!
//! The controller computes with the drawing. It is therefore told a *fake* target: the pose that the drawing gives for the joints at
//! which the identified robot stands where it should,
//!
//! ```text
//! identified(joints) = wanted,    fake = drawn(joints)
//! ```
//!
//! so that its own inverse kinematics leads it to those joints.

mod calibrated_arm;
mod compensator;
mod conditions;
mod fake_file;
mod flange;
mod krl;
mod nominal_inverse;
mod own_bodies;
mod rigid;
mod targets_file;
mod task;
mod uncertainty;
mod urdf;

pub use calibrated_arm::CalibratedArm;
pub use compensator::{Compensated, Compensator, Fake, NEAR_SINGULAR, Refusal, Target, Wanted, Warnings};
pub use conditions::Conditions;
pub use fake_file::fake_csv;
pub use flange::flange_frame;
pub use krl::{KrlError, KrlProgram, Motion};
pub use nominal_inverse::NominalInverse;
pub use rigid::{LeftOut, RigidRobot};
pub use targets_file::{Expected, read_targets};
pub use task::{Task, TaskError, WorkFrame};
pub use uncertainty::Uncertainty;
pub use urdf::urdf;
