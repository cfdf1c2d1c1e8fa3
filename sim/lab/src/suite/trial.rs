//! One blind trial.

use calibench::diagnosis::{Diagnosis, Examination, diagnose_examined};
use calibench::files::FileError;
use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset};
use calibench::prediction::{PoseSource, WorkspaceError, WorkspacePoses};
use calibench::residuals::Validation;
use calibench::units::MM;
use nalgebra::Vector3;
use thiserror::Error;

use super::advice::{Advice, advised, suspects};
use super::answer::answer;
use super::hide::{Hidden, HideError, disturb, hide};
use super::outcome::{Outcome, claims};
use super::{Case, Kind};
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{Measurements, RunError, measure_all};
use calibench_sim::scenario::Scenario;

/// Error of a trial.
#[derive(Debug, Error)]
pub enum TrialError {
    /// The ground truth does not fit the cell.
    #[error(transparent)]
    Truth(#[from] FileError),
    /// The cell was not measured.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The robot was not identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// What was drawn cannot be hidden.
    #[error(transparent)]
    Hide(#[from] HideError),
    /// The case is not among those planned.
    #[error("a trial was not planned")]
    Unplanned,
}

/// Measures, calibrates, diagnoses and compares with the ground truth.
pub(super) fn trial(scenario: &Scenario, plans: &Plans, case: &Case, seed: u64, advice: Advice) -> Result<Outcome, TrialError> {
    let streams = Streams { seed, trial: case.trial() };
    let hidden = hide(case, scenario, plans, &mut streams.stream("suite"))?;
    let scenario = scenario.with_truth(hidden.truth(scenario)?)?;
    let (said, class, names) = (case.to_string(), case.class.clone(), hidden.names());
    let (kind, size) = (hidden.kind, hidden.size);
    let judged = match measure_all(&scenario, streams, plans, &mut ()) {
        Ok(mut measured) => {
            disturb(&mut measured.fit, case, &hidden);
            Trial::of(case, &scenario.model, &measured, advice).judged(hidden)?
        }
        // A robot so wrong that its balls cannot be centred is detected without any diagnosis.
        Err(RunError::Campaign(_)) => Outcome::default(),
        Err(e) => return Err(e.into()),
    };
    Ok(Outcome { case: said, class, kind, hidden: names, size, ..judged })
}

/// A measured robot and its ground truth.
struct Trial<'a> {
    case: &'a Case,
    model: &'a Model,
    fit: &'a Dataset,
    truth: Dataset,
    /// Joint angles at which the error is judged, rad.
    poses: WorkspacePoses,
    advice: Advice,
}

/// Result of following a diagnosis.
struct Followed {
    chi2_left: Option<f64>,
    after_mm: Option<f64>,
    expected_mm: Option<[f64; 3]>,
}

impl<'a> Trial<'a> {
    fn of(case: &'a Case, model: &'a Model, measured: &'a Measurements, advice: Advice) -> Self {
        let end = measured.fit.samples.iter().filter_map(|s| s.time_s).reduce(f64::max);
        let truth = at_truth(&measured.validation, &measured.validation_truth, end);
        let q = measured.validation.samples.iter().map(|s| s.q.clone()).collect();
        let poses = WorkspacePoses { q, source: PoseSource::Validation };
        Trial { case, model, fit: &measured.fit, truth, poses, advice }
    }

    /// Diagnoses, and compares the answer with the hidden effects.
    fn judged(&self, mut hidden: Hidden) -> Result<Outcome, IdentifyError> {
        let data = [NamedDataset::new("fit", self.fit)];
        let examination = Examination::new(&data, self.model)?;
        let diagnosis = diagnose_examined(&data, &examination)?;
        let predicted = WorkspaceError::predict(&data, &examination, &self.poses)?;
        // Effects that the data cannot test do not show in them, so they do not count as contributors.
        let untestable = |id: &str| diagnosis.untestable.iter().any(|u| u.effect == id);
        let testable = !hidden.effects.iter().any(|(id, _)| untestable(id));
        hidden.effects.retain(|(id, _)| hidden.kind == "one" || !untestable(id));
        let visible = match examination.visible_rms(&data, &hidden.effects) {
            Err(_) if !testable => Vec::new(),
            visible => visible?,
        };
        let followed = self.followed(&diagnosis)?;
        let before_mm = self.error_mm(&examination.calibration(&data))?;
        let mean = predicted.map_or([f64::NAN; 3], |w| [w.mean.expected, w.mean.low, w.mean.high].map(|v| v / MM));
        let after = followed.expected_mm;
        Ok(Outcome {
            visible: visible.iter().map(|v| v * v).sum::<f64>().sqrt(),
            testable,
            before_mm,
            predicted_mm: mean[0],
            predicted_low_mm: mean[1],
            predicted_high_mm: mean[2],
            after_mm: Some(followed.after_mm.unwrap_or(before_mm)),
            oracle_mm: self.oracle_mm(&hidden),
            predicted_after_mm: after.map(|e| e[0]),
            predicted_after_low_mm: after.map(|e| e[1]),
            predicted_after_high_mm: after.map(|e| e[2]),
            ..answer(&diagnosis, self.case, &hidden, &visible, followed.chi2_left)
        })
    }

    /// Fits the claimed effects and the advised model.
    fn followed(&self, diagnosis: &Diagnosis) -> Result<Followed, IdentifyError> {
        let data = [NamedDataset::new("fit", self.fit)];
        let first = diagnosis.findings.first().filter(|_| claims(diagnosis.verdict)).map(|f| f.hypothesis.in_model.to_string());
        let bad = suspects(diagnosis);
        let claimed: Vec<String> = if bad.is_empty() { first.into_iter().collect() } else { bad };
        let model = claimed.iter().fold(self.model.clone(), |model, effect| model.with(effect));
        let with_claimed = if claimed.is_empty() { None } else { identify(&data, &model).ok() };
        let chi2_left = with_claimed.as_ref().map(|c| c.chi2_per_dof);
        let advised = advised(&data, self.model, with_claimed, &self.poses, self.advice);
        let after_mm = advised.as_ref().map(|a| self.error_mm(&a.calibration)).transpose()?;
        Ok(Followed { chi2_left, after_mm, expected_mm: advised.and_then(|a| a.expected_mm) })
    }

    /// Mean position error over the workspace, mm.
    fn error_mm(&self, calibration: &Calibration) -> Result<f64, IdentifyError> {
        let prediction = calibration.predict(&[NamedDataset::new("truth", &self.truth)], Use::Validation)?;
        Ok(Validation::of(&prediction).map_or(f64::NAN, |v| v.mean / MM))
    }

    /// Mean position error over the workspace, mm, of a model that includes the hidden effects, if they are few and
    /// from the catalogue.
    fn oracle_mm(&self, hidden: &Hidden) -> Option<f64> {
        if !matches!(self.case.kind, Kind::Effects { .. } | Kind::Outliers { .. }) {
            return None;
        }
        let model = hidden.effects.iter().fold(self.model.clone(), |m, (id, _)| m.with(id));
        let calibration = identify(&[NamedDataset::new("fit", self.fit)], &model).ok()?;
        self.error_mm(&calibration).ok()
    }
}

/// The validation poses with the true TCP positions, at the end of the session, when drifts are complete.
fn at_truth(validation: &Dataset, truth: &[Vector3<f64>], end: Option<f64>) -> Dataset {
    let mut data = validation.clone();
    for (sample, at) in data.samples.iter_mut().zip(truth) {
        sample.measured = Measured::Point(*at);
        sample.time_s = end;
    }
    data
}
