//! Replay of a calibration: what a run folder holds, as a recording for the viewer [rerun](https://rerun.io).
//!
//! Everything is told from files, by the procedure's library. The folder of a real campaign is replayed as that of a simulated one, and
//! what a folder lacks is left out; a real one lacks where the arm truly stood.

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
pub use film::{Wishes, record};
pub use subject::Subject;
