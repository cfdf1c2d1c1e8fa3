//! Why a workbench does not do what is asked.

use calibench::files::FileError;
use calibench::identify::IdentifyError;
use thiserror::Error;

use crate::blame::with_reasons;
use crate::step::StepError;

/// Why something is not done.
#[derive(Debug, Error)]
pub enum Refusal {
    /// What a field of the page holds is wrong.
    #[error("{message}")]
    Field {
        /// The field.
        field: &'static str,
        /// What is wrong, and what to do.
        message: String,
    },
    /// Data and model do not go together.
    #[error("{}", with_reasons(.0))]
    Data(#[from] IdentifyError),
    /// It cannot be saved.
    #[error(transparent)]
    File(#[from] FileError),
}

impl Refusal {
    /// A field is to blame.
    pub(super) fn field(field: &'static str, message: impl Into<String>) -> Self {
        Refusal::Field { field, message: message.into() }
    }
}

impl From<StepError> for Refusal {
    fn from(error: StepError) -> Self {
        Refusal::field("effect", with_reasons(&error))
    }
}
