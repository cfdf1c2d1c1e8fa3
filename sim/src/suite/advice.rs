//! What the program advises: the one place where a suite asks it.

use calibench::assess::{Diagnosis, ProvingGround, ladder};
use calibench::effects::{set_aside_by, setting_aside};
use calibench::identify::{Calibration, Model};
use calibench::measure::Dataset;
use calibench::units::MM;

/// Whose advice is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Advice {
    /// The first finding of the diagnosis, where it claims one: one fit.
    #[default]
    Diagnosis,
    /// What the ladder recommends: many fits.
    Ladder,
}

/// A calibration that follows the advice.
pub(super) struct Advised {
    /// What was fitted.
    pub calibration: Calibration,
    /// Mean position error that it predicts for itself, and its 10 and 90 % quantiles, mm.
    pub expected_mm: Option<[f64; 3]>,
}

/// The calibration that the program advises; `None` where it advises to leave the model as it is, or what it advises cannot be fitted.
///
/// `with_claimed` is the fit with the effect that the diagnosis claims; the error is to be expected at `poses` (rad).
pub(super) fn advised(
    data: &[(&str, &Dataset)],
    model: &Model,
    with_claimed: Option<Calibration>,
    poses: &[Vec<f64>],
    advice: Advice,
) -> Option<Advised> {
    match advice {
        Advice::Diagnosis => Some(Advised { calibration: with_claimed?, expected_mm: None }),
        Advice::Ladder => {
            let climbed = ladder(data, model, ProvingGround { poses, checks: &[] }, &mut |_| ()).ok()?;
            let rung = climbed.recommended();
            let expected = rung.workspace.as_ref().map(|w| [w.mean.expected, w.mean.low, w.mean.high].map(|v| v / MM));
            Some(Advised { calibration: rung.calibration.clone(), expected_mm: expected })
        }
    }
}

/// Samples that a diagnosis says are bad, by their effects `outlier:ID`.
pub(super) fn suspects(diagnosis: &Diagnosis) -> Vec<String> {
    let sample = |id: String| (diagnosis.advises_to_set_aside(&id)).then(|| setting_aside(&id));
    let suspected = diagnosis.scatter.suspects.iter().map(|s| s.sample.clone());
    let named = diagnosis.findings.iter().filter_map(|f| set_aside_by(&f.hypothesis.in_model).map(str::to_owned));
    let mut all: Vec<String> = suspected.chain(named).filter_map(sample).collect();
    all.sort();
    all.dedup();
    all
}
