//! Accuracy at poses not used in the fit.

use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::problem::Use;
use calibench::measure::dataset::NamedDataset;
use calibench::residuals::Validation;

use crate::subject::Subject;

/// Position errors at poses not used in the fit.
pub struct Judgement {
    /// Errors of the nominal arm.
    pub before: Validation,
    /// Errors of the calibrated arm.
    pub after: Validation,
}

impl Judgement {
    /// Evaluates a calibration; `None` if all poses were fitted.
    ///
    /// # Errors
    /// When the poses do not match the calibration.
    pub fn of(subject: &Subject) -> Result<Option<Self>, IdentifyError> {
        if !subject.has_judging_points() {
            return Ok(None);
        }
        let judging = match &subject.validation {
            Some(validation) => NamedDataset::new("validation", validation),
            None => NamedDataset::new(&subject.name, &subject.dataset),
        };
        let errors = |of: &Calibration| of.predict(&[judging], Use::Validation).map(|prediction| Validation::of(&prediction));
        let (before, after) = (errors(&subject.calibration.nominal())?, errors(&subject.calibration)?);
        Ok(before.zip(after).map(|(before, after)| Judgement { before, after }))
    }
}
