//! The model for which measurements are planned.

use crate::diagnosis::Verdict;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::selection::hold_out::HoldOut;
use crate::selection::ladder::LadderStep;
use crate::selection::ladder::{Ladder, ladder};

/// The ladder of a model, and the step for which measurements are planned.
#[derive(Debug, Clone)]
pub struct Planned {
    /// The ladder, starting from the first model.
    pub ladder: Ladder,
    /// True if measurements are planned for the first model, because these data cannot distinguish which effect it
    /// lacks; that has to be resolved first.
    pub in_question: bool,
}

impl Planned {
    /// The model to plan for, as a fitted step of the ladder.
    pub fn ladder_step(&self) -> &LadderStep {
        if self.in_question { self.ladder.first() } else { self.ladder.recommended() }
    }
}

/// Selects the model that the ladder recommends from `model`, unless the data cannot distinguish which effect `model`
/// lacks: the ladder would add one of them, and nothing would remain to be distinguished.
///
/// # Errors
/// As [`ladder`].
pub fn planned_for(datasets: &[NamedDataset<'_>], model: &Model, ground: HoldOut<'_>) -> Result<Planned, IdentifyError> {
    let ladder = ladder(datasets, model, ground)?;
    let first = &ladder.first().diagnosis;
    let verdict = first.verdict_of_the_rest();
    Ok(Planned { in_question: verdict == Verdict::Indistinguishable, ladder })
}
