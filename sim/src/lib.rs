//! Stand-in for the factory: the simulated cell, its ground truth, and the score.
//!
//! The procedure in [`calibench`] cannot name anything in this crate; it accesses the simulated cell through the same
//! traits as a real one.

pub mod cmm;
pub mod collision;
pub mod compensation;
pub mod contact;
pub mod controller;
pub mod dahl_friction;
pub mod effect_names;
pub mod flaw;
pub mod gauge;
pub mod ground_truth;
pub mod hidden;
pub mod locate_error;
pub mod mechanics;
mod mismatch;
pub mod planning;
pub mod plans;
pub mod plant;
pub mod plunger;
pub mod random;
pub mod repeatability;
pub mod rival;
pub mod rival_poses;
pub mod run;
pub mod scenario;
pub mod score;
pub mod session;
pub mod tilt;
pub mod tracker;
pub mod true_arm;
pub mod world;

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
