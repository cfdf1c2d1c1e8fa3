//! The program's advice: the only place where a suite requests it.

use calibench::diagnosis::Diagnosis;
use calibench::effects::catalogue::{set_aside_by, setting_aside};
use calibench::identify::Model;
use calibench::identify::calibration::Calibration;
use calibench::measure::dataset::NamedDataset;
use calibench::prediction::WorkspacePoses;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::ladder;
use calibench::units::MM;

/// Source of the advice that is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Advice {
    /// The first finding of the diagnosis, if it claims one: one fit.
    #[default]
    Diagnosis,
    /// The recommendation of the ladder: many fits.
    Ladder,
}

/// A calibration that follows the advice.
pub(super) struct Advised {
    /// The resulting calibration.
    pub calibration: Calibration,
    /// The mean position error it predicts for itself, with its 10 and 90 % quantiles, mm.
    pub expected_mm: Option<[f64; 3]>,
}

/// The calibration that the program advises; `None` if it advises to keep the model, or its advice cannot be fitted.
///
/// `with_claimed` is the fit with the effect claimed by the diagnosis; the expected error is predicted at `poses`.
pub(super) fn advised(
    data: &[NamedDataset<'_>],
    model: &Model,
    with_claimed: Option<Calibration>,
    poses: &WorkspacePoses,
    advice: Advice,
) -> Option<Advised> {
    match advice {
        Advice::Diagnosis => Some(Advised { calibration: with_claimed?, expected_mm: None }),
        Advice::Ladder => {
            let ladder = ladder(data, model, HoldOut { poses, checks: &[], worker: None }).ok()?;
            let ladder_step = ladder.recommended();
            let expected = ladder_step.workspace.as_ref().map(|w| [w.mean.expected, w.mean.low, w.mean.high].map(|v| v / MM));
            Some(Advised { calibration: ladder_step.calibration.clone(), expected_mm: expected })
        }
    }
}

/// Samples declared bad by a diagnosis, as their effects `outlier:ID`.
pub(super) fn suspects(diagnosis: &Diagnosis) -> Vec<String> {
    let sample = |id: String| (diagnosis.advises_to_set_aside(&id)).then(|| setting_aside(&id));
    let suspected = diagnosis.scatter.suspects.iter().map(|s| s.sample.clone());
    let named = diagnosis.findings.iter().filter_map(|f| set_aside_by(&f.hypothesis.in_model).map(str::to_owned));
    let mut all: Vec<String> = suspected.chain(named).filter_map(sample).collect();
    all.sort();
    all.dedup();
    all
}
