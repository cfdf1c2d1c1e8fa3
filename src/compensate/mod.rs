//! Application of a calibration: the joints that bring the tool to a desired pose, and the target to be commanded to the
//! robot's own controller.
//!
//! The controller computes with the nominal model. It is therefore commanded to a *fake* target: the nominal pose at the
//! joints that bring the identified robot to the desired pose,
//!
//! ```text
//! identified(joints) = desired,    fake = nominal(joints)
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
mod programs;
mod refusal;
mod rigid;
mod targets_file;
mod task;
mod uncertainty;
mod urdf;

pub use calibrated_arm::CalibratedArm;
pub use compensator::{Compensated, Compensator, Desired, Fake, NEAR_SINGULAR, Target, Warnings};
pub use conditions::Conditions;
pub use fake_file::fake_csv;
pub use flange::flange_frame;
pub use krl::{KrlError, KrlProgram, Motion};
pub use nominal_inverse::NominalInverse;
pub use programs::{Dialect, Permissions, Program, Remark, Rewritten, RewrittenProgram, read_program, rewrite_programs};
pub use refusal::Refusal;
pub use rigid::{LeftOut, RigidRobot};
pub use targets_file::{Expected, read_targets};
pub use task::{Task, TaskError, WorkFrame};
pub use uncertainty::Uncertainty;
pub use urdf::urdf;
