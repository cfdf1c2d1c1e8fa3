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

mod flange;

mod nominal_inverse;


mod task;
mod uncertainty;


pub use calibrated_arm::CalibratedArm;
pub use compensator::{Compensated, Compensator, Fake, Refusal, Target, Wanted, Warnings};
pub use conditions::Conditions;

pub use flange::flange_frame;

pub use nominal_inverse::NominalInverse;


pub use task::{Task, TaskError, WorkFrame};
pub use uncertainty::Uncertainty;

