//! Judgement: how a robot was, how it is, and how it is to be expected, from one place.
//!
//! Every screen that says how large the errors were before a calibration and after it, and what is to be expected where nothing was
//! measured, reads a [`Judgement`]; none computes a part of it again.

mod error_table;
mod expectations;

pub use error_table::{ErrorRow, ErrorTable, NoErrors, Stage};
pub use expectations::Expectations;

use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::selection::ladder::Ladder;

/// The errors of a robot, measured and expected.
#[derive(Debug, Clone)]
pub struct Judgement {
    /// The errors measured, before and after, at the same poses.
    pub errors: ErrorTable,
    /// The errors to expect of the last calibration of that table.
    pub expected: Expectations,
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
        Ok(Judgement { errors: ErrorTable::of(judged, calibrated, other), expected: Expectations::of(datasets, recommended)? })
    }
}
