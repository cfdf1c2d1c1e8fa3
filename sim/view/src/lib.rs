//! Replay of a calibration: what a run folder holds, as a recording for the viewer [rerun](https://rerun.io).
//!
//! Everything is told from files, by the procedure's library. Nothing here knows whether the cell was simulated: the folder of a real
//! campaign is replayed the same way, and what a folder lacks is left out.

mod arm;
mod blueprint;
mod centring;
mod chart;
mod decades;
mod failure;
mod film;
mod gauge;
mod journal;
mod paint;
mod residuals;
mod scene;
mod steps;
mod story;
mod subject;

pub use failure::ViewError;
pub use film::{Wishes, record};
pub use subject::Subject;
