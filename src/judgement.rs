//! Judgement: how a robot was, how it is, how it is to be expected, what causes it, and what to do, from one place.
//!
//! Every screen that says so reads a [`Judgement`]; none computes a part of it again.

mod error_table;
mod expectations;
pub mod side_by_side;

pub use error_table::{ErrorRow, ErrorTable, FarOff, NoErrors, Stage};
pub use expectations::{Expectations, Loose};

use crate::diagnosis::Diagnosis;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::selection::ladder::Ladder;
use crate::selection::{Advice, ToDo};

/// The errors of a robot, measured and expected; their cause; and what is to be done.
#[derive(Debug, Clone)]
pub struct Judgement {
    /// The errors measured, before and after, at the same poses.
    pub errors: ErrorTable,
    /// The errors to expect of the last calibration of that table.
    pub expected: Expectations,
    /// What the first model leaves, and why.
    pub cause: Diagnosis,
    /// The advice on the last calibration of that table.
    pub advice: Advice,
}

impl Judgement {
    /// The judgement of a ladder run on `datasets`: its first model is the calibration, and another that it recommends stands beside
    /// it. They are judged on `judged` (see [`ErrorTable::of`]).
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn of(datasets: &[NamedDataset<'_>], judged: &[NamedDataset<'_>], ladder: &Ladder) -> Result<Judgement, IdentifyError> {
        let (calibrated, recommended) = (&ladder.first().calibration, ladder.recommended());
        let other = (recommended.calibration.model != calibrated.model).then_some(&recommended.calibration);
        Ok(Judgement {
            errors: ErrorTable::of(judged, calibrated, other),
            expected: Expectations::of(datasets, recommended)?,
            cause: ladder.first().diagnosis.clone(),
            advice: Advice::after(ladder),
        })
    }

    /// Withdraws cause and advice for data that do not fit their robot and were accepted by force.
    pub fn doubt(&mut self) {
        self.cause.doubt();
        self.advice = Advice { to_do: ToDo::Unknown, step: None, refused: Vec::new() };
    }
}
