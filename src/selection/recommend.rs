//! Recommendation of a model, from its predictions at postures that were not fitted.
//!
//! The effects of the catalogue name causes; the error curves of all joints only correct errors. They are Fourier
//! series in every joint's angle, each band of orders regularised by the size that the evidence gives it. Each choice
//! is compared with the first model on the same postures, pair by pair.

mod choices;
pub(crate) mod curves;
mod linear;
mod rule;
mod shrinkage;
pub(crate) mod steps;

pub use choices::{Choice, FieldChoice, Kind as ChoiceKind, Recommendation, SizedCandidate, recommend};
pub use rule::{Gain, Insufficient};
