//! Judgement: how a robot was, how it is, and how it is to be expected, from one place.
//!
//! Every screen that says how large the errors were before a calibration and after it, and what is to be expected where nothing was
//! measured, reads a [`Judgement`]; none computes a part of it again.

mod error_table;
mod expectations;

pub use error_table::{ErrorRow, ErrorTable, NoErrors, Stage};
pub use expectations::Expectations;

use crate::identify::calibration::{Calibration, IdentifyError};
use crate::measure::dataset::NamedDataset;
use crate::selection::ladder::{Ladder, LadderStep};

/// The errors of a robot, measured and expected.
#[derive(Debug, Clone)]
pub struct Judgement {
    /// The errors measured, before and after, at the same poses.
    pub errors: ErrorTable,
    /// The errors to expect of the last calibration of that table.
    pub expected: Expectations,
}

impl Judgement {
    /// The judgement of one model: fitted to `datasets`, judged on the rows of set `validation` of `judged`, or on its own rows if
    /// there are none.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn of_step(
        datasets: &[NamedDataset<'_>],
        judged: &[NamedDataset<'_>],
        step: &LadderStep,
    ) -> Result<Judgement, IdentifyError> {
        Judgement::of(datasets, judged, &step.calibration, step)
    }

    /// The judgement of a ladder: its first model is the calibration, and another that it recommends stands beside it.
    ///
    /// # Errors
    /// As [`Judgement::of_step`].
    pub fn of_ladder(
        datasets: &[NamedDataset<'_>],
        judged: &[NamedDataset<'_>],
        ladder: &Ladder,
    ) -> Result<Judgement, IdentifyError> {
        Judgement::of(datasets, judged, &ladder.first().calibration, ladder.recommended())
    }

    fn of(
        datasets: &[NamedDataset<'_>],
        judged: &[NamedDataset<'_>],
        calibrated: &Calibration,
        recommended: &LadderStep,
    ) -> Result<Judgement, IdentifyError> {
        let other = (recommended.calibration.model != calibrated.model).then_some(&recommended.calibration);
        Ok(Judgement { errors: ErrorTable::of(judged, calibrated, other), expected: Expectations::of(datasets, recommended)? })
    }
}
