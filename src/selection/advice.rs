//! Recommended next step for a model: one judgement, used wherever advice is given.

use std::convert::Infallible;
use std::ops::ControlFlow;

use super::hold_out::HoldOut;
use super::ladder::next_step::next_step;
use super::ladder::{LadderProgress, LadderStep, RefusedStep};
use crate::diagnosis::Verdict;
use crate::effects::EffectId;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;

/// Recommended next step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ToDo {
    /// Nothing: the residual is noise.
    Nothing,
    /// Nothing can be said: the fit did not converge, or the data do not fit their robot.
    Unknown,
    /// Add the effects of the step: they predict postures better that were not fitted.
    Add,
    /// Measure first: the data cannot tell which of several effects is missing.
    Distinguish,
    /// Choose among other models, or measure more: no single step helps.
    Choose,
}

impl ToDo {
    /// Name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            ToDo::Nothing => "nothing",
            ToDo::Unknown => "unknown",
            ToDo::Add => "add",
            ToDo::Distinguish => "distinguish",
            ToDo::Choose => "choose",
        }
    }
}

/// The advice on a model: the step that a ladder takes from it, unless that has to wait.
#[derive(Debug, Clone)]
pub struct Advice {
    /// Recommended next step.
    pub to_do: ToDo,
    /// The first step of the ladder, fitted; with [`ToDo::Distinguish`] the one that it would take. `None` if it takes none.
    pub step: Option<Box<LadderStep>>,
    /// Steps that the ladder tried before.
    pub refused: Vec<RefusedStep>,
}

impl Advice {
    /// The advice on a fitted and judged model.
    ///
    /// # Errors
    /// When the gain of the effects cannot be computed.
    pub fn on(datasets: &[NamedDataset<'_>], below: &LadderStep, ground: HoldOut<'_>) -> Result<Self, IdentifyError> {
        let mut refused: Vec<RefusedStep> = Vec::new();
        let diagnosis = &below.diagnosis;
        let verdict = diagnosis.verdict_without_suspects.unwrap_or(diagnosis.verdict);
        let without_step = match diagnosis.verdict {
            _ if below.calibration.unconverged().is_some() => Some(ToDo::Unknown),
            Verdict::DataDoNotFit => Some(ToDo::Unknown),
            noise if noise.is_noise() => Some(ToDo::Nothing),
            _ => None,
        };
        if let Some(to_do) = without_step {
            return Ok(Advice { to_do, step: None, refused });
        }
        let next = next_step::<Infallible>(datasets, std::slice::from_ref(below), ground, &mut |progress| {
            if let LadderProgress::Refused(step) = progress {
                refused.push(step.clone());
            }
            ControlFlow::Continue(())
        })?;
        let step = next.ok();
        // A sample that disagrees with all others is excluded in any case.
        let sets_aside = step.as_ref().is_some_and(|step| step.added == diagnosis.without_suspects());
        let to_do = match (&step, verdict) {
            (_, Verdict::Indistinguishable) if !sets_aside => ToDo::Distinguish,
            (Some(_), _) => ToDo::Add,
            (None, _) => ToDo::Choose,
        };
        Ok(Advice { to_do, step, refused })
    }

    /// The effects of the step.
    #[must_use]
    pub fn effects(&self) -> &[EffectId] {
        self.step.as_ref().map_or(&[], |step| &step.added)
    }
}
