//! Identification: the model, the unknowns, the fit, which parameters the data can separate, and how well.

mod adjustment;
mod calibration;
mod calibration_file;
mod determined;
mod fit;
mod fit_result;
mod fitted_rows;
mod fleet;
mod fleet_prior;
mod identified;
mod model;
mod model_error;
mod model_file;
mod own_effects;
mod prediction;
mod problem;
mod run_change;

pub use adjustment::Adjustment;
pub use calibration::{Calibration, Estimate, IdentifyError, MeasuredSetup};
#[cfg(feature = "schema")]
pub(crate) use calibration_file::calibration_schema;
pub use calibration_file::{FORMAT as CALIBRATION_FORMAT, read_calibration, write_calibration};
pub use determined::{independent_parameters, observability_of};
pub use fit::{check_nested, fit, fit_from, fit_larger, fit_some};
pub use fit_result::{Fit, FitError, Outcome, Unresolved};
pub use fitted_rows::{FittedRows, are_copied};
pub use fleet::{CONFLICT, FleetError, FleetJudged, PriorUsed, SeemOne, identify_with_fleet, read_fleet, write_fleet};
pub use fleet_prior::{Fleet, FleetParameter, FleetPrior};
pub use identified::{identify, identify_without_indices};
pub use model::{BACKGROUND_WIDTH, Model, TorquePosture, UNREGULARISED};
pub use model_error::covariance_with_model_error;
#[cfg(feature = "schema")]
pub(crate) use model_file::model_schema;
pub use model_file::{EffectList, check_effects, read_model, write_model, write_model_like};
pub use own_effects::{OwnEffectTable, OwnMistake, own_effects};
pub use prediction::{Application, Prediction};
pub(crate) use problem::Circumstance;
pub use problem::{Parameter, PosedSample, Prior, Problem, ProblemError, Setup, Use, missing};
pub use run_change::RunChange;
