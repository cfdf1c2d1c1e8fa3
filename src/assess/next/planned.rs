//! For which model measurements are planned.

use crate::assess::hold_out::HoldOut;
use crate::assess::ladder::{Ladder, ladder};
use crate::assess::ladder_step::LadderStep;
use crate::assess::verdict::Verdict;
use crate::identify::{IdentifyError, Model};
use crate::measure::Dataset;

/// The ladder of a model, and which of its steps measurements are planned for.
#[derive(Debug, Clone)]
pub struct Planned {
    /// From the model to begin with.
    pub ladder: Ladder,
    /// It is the model to begin with, because these data cannot tell which effect is missing in it: that is to be found out first.
    pub in_question: bool,
}

impl Planned {
    /// The model to plan for, fitted.
    pub fn ladder_step(&self) -> &LadderStep {
        if self.in_question { self.ladder.first() } else { self.ladder.recommended() }
    }
}

/// The model that the ladder recommends from `model`, unless it is in question which effect that lacks: a ladder takes one of them, and
/// nothing would be left to be distinguished.
///
/// # Errors
/// As [`ladder`].
pub fn planned_for(datasets: &[(&str, &Dataset)], model: &Model, ground: HoldOut<'_>) -> Result<Planned, IdentifyError> {
    let ladder = ladder(datasets, model, ground, &mut |_| ())?;
    let first = &ladder.first().diagnosis;
    let verdict = first.verdict_without_suspects.unwrap_or(first.verdict);
    Ok(Planned { in_question: verdict == Verdict::Indistinguishable, ladder })
}
