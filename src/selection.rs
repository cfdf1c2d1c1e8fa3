//! Selection of a model: which effects to add, judged at postures that were left out, and when to stop.
//!
//! [`ladder`] adds one effect after another, [`recommend`](mod@recommend) chooses among models, [`hold_out`] judges either on rows held out.

mod advice;
mod fit_scores;
mod fitted_model;
pub mod hold_out;
pub mod ladder;
mod objections;
pub mod recommend;
mod withdrawal;

pub use advice::{Advice, ToDo};
pub use fit_scores::{FitScores, SessionError};
pub use fitted_model::{FittedModel, needs_diagnosis, step_gains};
pub use objections::Objection;
pub use withdrawal::Contradiction;
