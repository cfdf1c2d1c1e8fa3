//! What stands in for the factory: the simulated cell, the truth it keeps, and the score.
//!
//! The procedure in [`calibench`] cannot name anything in here; it meets the simulated cell through the same traits as a real one.

pub mod arm;
pub mod blame;
pub mod cli;
pub mod cmm;
pub mod collision;
pub mod compensation;
pub mod contact;
pub mod controller;
pub mod design;
pub mod flaw;
pub mod gauge;
pub mod ground_truth;
pub mod hidden;
mod interruption;
mod mismatch;
#[cfg(feature = "mujoco")]
pub mod mujoco;
pub mod opened;
pub mod planning;
pub mod plant;
pub mod plunger;
pub mod precision;
mod proposal_files;
pub mod prove;
pub mod random;
pub mod repeatability;
pub mod rival;
pub mod rival_poses;
pub mod run;
pub mod scenario;
pub mod score;
pub mod serve;
pub mod session;
pub mod side;
pub mod step;
pub mod study;
pub mod suite;
pub mod tracker;
pub mod true_arm;
pub mod workbench;
pub mod world;
