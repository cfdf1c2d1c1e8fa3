//! One plunger indicator of the TriCal.

use thiserror::Error;

/// Reason why an indicator gave no reading.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum IndicatorError {
    /// No answer within its time.
    #[error("the indicator does not answer")]
    Silent,
    /// The plunger is outside its measuring range (ERR3 of the Sylvac protocol).
    #[error("the plunger is outside its measuring range")]
    OverRange,
    /// The indicator reports a fault of its own.
    #[error("the indicator reports a fault: {detail}")]
    Fault {
        /// The fault as the indicator reports it.
        detail: String,
    },
    /// The answer cannot be parsed.
    #[error("the indicator's answer cannot be understood: {frame:?}")]
    Garbled {
        /// The bytes received.
        frame: String,
    },
}

/// A plunger indicator, mastered so that a centred datum ball reads zero.
pub trait Indicator {
    /// The reading in metres, positive when the plunger is pushed in: the coordinate of the ball's centre along the tool axis.
    ///
    /// # Errors
    /// When there is no reading.
    fn read(&mut self) -> Result<f64, IndicatorError>;

    /// Makes the present plunger position read `value` (m).
    ///
    /// # Errors
    /// When the indicator refuses.
    fn preset(&mut self, value: f64) -> Result<(), IndicatorError>;
}

impl<T: Indicator + ?Sized> Indicator for &mut T {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        (**self).read()
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        (**self).preset(value)
    }
}
