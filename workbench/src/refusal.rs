//! Reasons for which the workbench refuses an action.

use calibench::files::{FileError, with_reasons};
use calibench::identify::calibration::IdentifyError;
use thiserror::Error;

use crate::step::StepError;

/// The reason for refusing an action.
#[derive(Debug, Error)]
pub enum Refusal {
    /// A field of the page holds an invalid value.
    #[error("{message}")]
    Field {
        /// The field.
        field: &'static str,
        /// Description of the error, and the remedy.
        message: String,
    },
    /// The request is for a model that is not the current one any longer.
    #[error("the model has changed in the meantime")]
    Changed,
    /// Nobody waits for it any more.
    #[error("Cancelled; the workbench is as it was before.")]
    Cancelled,
    /// Data and model do not match.
    #[error("{}", with_reasons(.0))]
    Data(#[from] IdentifyError),
    /// The result cannot be saved.
    #[error(transparent)]
    File(#[from] FileError),
}

impl Refusal {
    /// A refusal caused by a field.
    pub(super) fn field(field: &'static str, message: impl Into<String>) -> Self {
        Refusal::Field { field, message: message.into() }
    }
}

impl From<StepError> for Refusal {
    fn from(error: StepError) -> Self {
        Refusal::field("effect", with_reasons(&error))
    }
}
