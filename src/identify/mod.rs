//! Finding the numbers: the model, the unknowns, the fit, what the data can tell apart, and how well.

mod adjustment;
mod calibration;
mod calibration_file;
mod fit;
mod identified;
pub(crate) mod linalg;
mod model;
mod model_error;
mod model_file;
mod observability;
mod own_effects;
mod problem;

pub use adjustment::Adjustment;
pub use calibration::{Application, Calibration, Estimate, IdentifyError, MeasuredSetup, Prediction};
pub use calibration_file::{read_calibration, write_calibration};
pub use fit::{
    Fit, FitError, Outcome, Unresolved, check_nested, fit, fit_from, fit_larger, fit_some, independent_parameters,
    observability_of,
};
pub use identified::identify;
pub use linalg::LinalgError;
pub use model::{FREELY_FITTED, Model, ORDINARY_WIDTH, TorquePosture};
pub use model_error::covariance_with_model_error;
pub use model_file::{check_effects, read_model, write_model, write_model_like};
pub use observability::Observability;
pub use own_effects::{OwnEffectTable, OwnMistake, own_effects};
pub(crate) use problem::Circumstance;
pub use problem::{Knowledge, Parameter, PosedSample, Problem, ProblemError, Setup, Use, missing};
