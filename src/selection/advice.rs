//! Recommended next step for a model: one judgement, used wherever advice is given.

use std::convert::Infallible;
use std::ops::ControlFlow;

use super::hold_out::HoldOut;
use super::ladder::ending_at;
use super::ladder::next_step::next_step;
use super::ladder::{Ladder, LadderProgress, LadderStep, RefusedStep, StopReason};
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
    /// Choose a model of all errors at once: no single step helps, but such a model predicts postures better that were not fitted.
    Choose,
    /// Stop here, although what is left is not noise: nothing that was tried helps.
    Stop,
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
            ToDo::Stop => "stop",
        }
    }
}

/// The advice on a model: the step that a ladder takes from it, unless that has to wait. A ladder that is followed to its end ends
/// where the advice is to stop.
#[derive(Debug, Clone)]
pub struct Advice {
    /// Recommended next step.
    pub to_do: ToDo,
    /// The first step of the ladder, fitted; with [`ToDo::Distinguish`] the one that it would take, with [`ToDo::Choose`] the model
    /// that it recommends. `None` if it takes none.
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
        let verdict = diagnosis.verdict_of_the_rest();
        if let Some(to_do) = without_step(below) {
            return Ok(Advice { to_do, step: None, refused });
        }
        let next = next_step::<Infallible>(datasets, std::slice::from_ref(below), ground, &mut |progress| {
            if let LadderProgress::Refused(step) = progress {
                refused.push(step.clone());
            }
            ControlFlow::Continue(())
        })?;
        let step = match next {
            Ok(step) => step,
            Err(_) if verdict == Verdict::Indistinguishable => {
                return Ok(Advice { to_do: ToDo::Distinguish, step: None, refused });
            }
            Err(tried) => {
                let ladder = ending_at(datasets, below, tried, ground)?;
                let other = ladder.recommended();
                let goes_on = other.model != below.model;
                let to_do = if goes_on { ToDo::Choose } else { ToDo::Stop };
                return Ok(Advice { to_do, step: goes_on.then(|| Box::new(other.clone())), refused });
            }
        };
        // A sample that disagrees with all others is excluded in any case.
        let sets_aside = step.added == diagnosis.without_suspects();
        let waits = verdict == Verdict::Indistinguishable && !sets_aside;
        let to_do = if waits { ToDo::Distinguish } else { ToDo::Add };
        Ok(Advice { to_do, step: Some(step), refused })
    }

    /// The advice on the model that a ladder recommends, which is where it ends: nothing more is to be added.
    #[must_use]
    pub fn after(ladder: &Ladder) -> Self {
        let end = ladder.recommended();
        let to_do = without_step(end).unwrap_or(match end.diagnosis.verdict_of_the_rest() {
            Verdict::Indistinguishable => ToDo::Distinguish,
            _ => ToDo::Stop,
        });
        let refused = match &ladder.top {
            StopReason::NoStepHelps { tried } => tried.clone(),
            _ => Vec::new(),
        };
        Advice { to_do, step: None, refused }
    }

    /// The effects of the step.
    #[must_use]
    pub fn effects(&self) -> &[EffectId] {
        self.step.as_ref().map_or(&[], |step| &step.added)
    }
}

/// What is to be done where no step is tried.
fn without_step(step: &LadderStep) -> Option<ToDo> {
    match step.diagnosis.verdict {
        _ if step.calibration.unconverged().is_some() => Some(ToDo::Unknown),
        Verdict::DataDoNotFit => Some(ToDo::Unknown),
        noise if noise.is_noise() => Some(ToDo::Nothing),
        _ => None,
    }
}
