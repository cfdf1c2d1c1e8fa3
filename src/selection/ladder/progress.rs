//! Progress of a ladder as it is reported to an observer, which may cancel it.

use std::convert::Infallible;
use std::ops::ControlFlow;

use super::{LadderStep, RefusedStep};
use crate::effects::EffectId;
use crate::identify::calibration::IdentifyError;

/// Progress of a ladder, for observers.
#[derive(Debug)]
pub enum LadderProgress<'a> {
    /// Effects are being added, in one step, to the model of the last step.
    Trying(&'a [EffectId]),
    /// That step was refused.
    Refused(&'a RefusedStep),
    /// A step was reached: the first model, one with more effects, or a recommended model that is not one of the steps.
    Reached(&'a LadderStep),
    /// The error curves, the steps and the whole library are being compared.
    Choosing,
}

/// Receives progress; `Break` cancels the ladder.
pub(crate) type Observer<'o, B> = dyn FnMut(LadderProgress<'_>) -> ControlFlow<B> + 'o;

/// Observes nothing, and so never cancels.
pub(super) fn unobserved(_: LadderProgress<'_>) -> ControlFlow<Infallible> {
    ControlFlow::Continue(())
}

/// Reason why a ladder has no result.
#[derive(Debug)]
pub(crate) enum Interrupted<B> {
    /// Its observer cancelled it.
    Cancelled(B),
    /// A model cannot be fitted or judged.
    Failed(IdentifyError),
}

impl<B> From<IdentifyError> for Interrupted<B> {
    fn from(error: IdentifyError) -> Self {
        Interrupted::Failed(error)
    }
}

impl From<Interrupted<Infallible>> for IdentifyError {
    fn from(interrupted: Interrupted<Infallible>) -> Self {
        match interrupted {
            Interrupted::Failed(error) => error,
        }
    }
}

/// Reports progress.
///
/// # Errors
/// [`Interrupted::Cancelled`] if the observer cancels.
pub(super) fn report<B>(observer: &mut Observer<'_, B>, progress: LadderProgress<'_>) -> Result<(), Interrupted<B>> {
    match observer(progress) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(value) => Err(Interrupted::Cancelled(value)),
    }
}
