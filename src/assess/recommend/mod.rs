//! One recommendation: which model to use, decided by what it predicts at postures that were not fitted.
//!
//! The catalogue names causes, the error curves of all joints correct: Fourier series in every joint's angle, each band of orders held to
//! the size that the evidence gives it. A choice is compared with the model to begin with on the same postures, pair by pair.

mod choices;
mod curves;
mod folds;
mod linear;
mod postures;
mod robust;
mod rule;
mod shrinkage;

pub use choices::{Choice, Kind, Recommendation, recommend};
pub use folds::Division;
pub use rule::Gain;
