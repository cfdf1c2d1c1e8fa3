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
pub mod conditions;
mod fake_file;
pub mod flange;
pub mod krl;
pub mod mjcf;
mod nominal_inverse;
mod own_bodies;
mod refusal;
pub mod rigid;
pub mod targets_file;
mod task;
mod uncertainty;
pub mod urdf;

pub use compensator::{Compensated, Compensator, Desired, Fake, NEAR_SINGULAR, Target};
pub(crate) use nominal_inverse::NominalInverse;
pub use refusal::{Refusal, Warnings};
pub use task::{Task, TaskError, WorkFrame};
pub use uncertainty::Uncertainty;
