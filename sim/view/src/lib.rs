//! Replay of a calibration: converts a run folder to a recording for the viewer [rerun](https://rerun.io).
//!
//! Everything is read from files, through the procedure's library. The folder of a real campaign is replayed like that of a
//! simulated one, and missing parts are left out; a real one lacks the true postures of the arm.

mod arm;
mod at_rest;
mod blueprint;
mod centring;
mod chart;
mod decades;
mod failure;
mod film;
mod gauge;
mod journal;
mod judgement;
mod magnification;
mod paint;
mod residuals;
mod scene;
mod steps;
mod story;
mod subject;
mod truth;

pub use failure::ViewError;
pub use film::{RecordOptions, record};
pub use subject::Subject;
