//! What the poses say that were not fitted.

use calibench::assess::Validation;
use calibench::identify::{Calibration, IdentifyError, Use};

use crate::subject::Subject;

/// Position errors at poses that were not fitted.
pub struct Judgement {
    /// Of the arm as drawn.
    pub before: Validation,
    /// Of the calibrated arm.
    pub after: Validation,
}

impl Judgement {
    /// The judgement on a calibration; `None` where everything was fitted.
    ///
    /// # Errors
    /// When the poses do not go with the calibration.
    pub fn of(subject: &Subject) -> Result<Option<Self>, IdentifyError> {
        if !subject.has_judging_points() {
            return Ok(None);
        }
        let judging = match &subject.validation {
            Some(validation) => ("validation", validation),
            None => (subject.name.as_str(), &subject.dataset),
        };
        let errors = |of: &Calibration| of.predict(&[judging], Use::Validation).map(|prediction| Validation::of(&prediction));
        let (before, after) = (errors(&subject.calibration.as_drawn())?, errors(&subject.calibration)?);
        Ok(before.zip(after).map(|(before, after)| Judgement { before, after }))
    }
}
