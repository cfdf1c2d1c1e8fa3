//! Identification: the model, the unknowns, the fit, which parameters the data can separate, and how well.

mod adjustment;
mod asked_again;
pub mod calibration;
mod calibration_file;
mod determined;
mod error_field_file;
pub mod fit;
mod fit_result;
mod fitted_rows;
pub mod fleet;
mod fleet_prior;
mod identified;
mod model;
mod model_error;
pub mod model_file;
mod own_effects;
mod prediction;
pub mod problem;
mod run_change;

pub use adjustment::Adjustment;
#[cfg(feature = "schema")]
pub(crate) use calibration_file::calibration_schema;
pub use fitted_rows::{FittedRows, are_copied};
pub use identified::{identify, identify_without_indices};
pub use model::{BACKGROUND_WIDTH, Model, TorquePosture};
#[cfg(feature = "schema")]
pub(crate) use model_file::model_schema;
pub use prediction::{Application, Prediction};
pub use run_change::RunChange;
