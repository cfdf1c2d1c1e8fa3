//! One blind trial.

use calibench::assess::{Examination, Validation, WorkspaceError, diagnose_examined};
use calibench::files::FileError;
use calibench::identify::{Calibration, IdentifyError, Use, identify};
use calibench::measure::{Dataset, Measured};
use calibench::units::MM;
use nalgebra::Vector3;
use serde::Serialize;
use thiserror::Error;

use super::advice::{Advice, advised};
use super::answer::answer;
use super::hide::{disturb, hide};
use super::{Case, Kind};
use crate::random::Streams;
use crate::run::{Plans, RunError, measure_all};
use crate::scenario::Scenario;

/// Why a trial gave nothing.
#[derive(Debug, Error)]
pub enum TrialError {
    /// The truth does not fit the cell.
    #[error(transparent)]
    Truth(#[from] FileError),
    /// The cell was not measured.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The robot was not identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The case is none of those that were planned.
    #[error("a trial was not planned")]
    Unplanned,
}

/// What came out of one trial: the truth and the answer side by side.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[allow(missing_docs)] // the columns of the table of trials
pub struct Outcome {
    pub case: String,
    /// `nothing`, `one`, `two`, `clutter`, `dense`, `unknown`, `outliers` or `moved_ball`.
    pub kind: &'static str,
    /// Ids of what is hidden, joined by blanks.
    pub hidden: String,
    pub size: f64,
    /// What of it the fitted model does not absorb, in units of noise.
    pub visible: f64,
    /// Whether the data can test it at all.
    pub testable: bool,
    pub verdict: &'static str,
    /// The best finding, and those that are the same in these data.
    pub top: String,
    pub rivals: String,
    pub top3: String,
    pub set95: String,
    pub top_right: bool,
    pub top_right_merged: bool,
    pub top3_right: bool,
    pub covered: bool,
    pub joint_right: bool,
    /// That what is hidden is in no catalogue was said, or the one member of the catalogue that is the same was named.
    pub said_so: bool,
    /// The largest contributor of all effects fitted at once, and whether it is the truly largest.
    pub contributor: String,
    pub contributor_right: bool,
    /// Mean position error over the workspace, free of the tracker's noise: of the calibration, as it predicts it itself, after the
    /// advice, with what is hidden added.
    pub before_mm: f64,
    pub predicted_mm: f64,
    pub after_mm: Option<f64>,
    pub oracle_mm: Option<f64>,
    /// The class for which it counts.
    pub class: String,
    /// Whether the answer is right, as its class has it.
    pub right: bool,
    /// Chi-square per degree of freedom with the effect that is claimed.
    pub chi2_left: Option<f64>,
    /// 10 and 90 % of the predicted error.
    pub predicted_low_mm: f64,
    pub predicted_high_mm: f64,
    /// The same as the advised calibration predicts it, where it does.
    pub predicted_after_mm: Option<f64>,
    pub predicted_after_low_mm: Option<f64>,
    pub predicted_after_high_mm: Option<f64>,
}

impl Outcome {
    /// Whether an effect of the catalogue was claimed.
    pub fn claimed(&self) -> bool {
        claims(self.verdict)
    }
}

/// Whether a verdict names effects as the whole of what is missing.
fn claims(verdict: &str) -> bool {
    matches!(verdict, "identified" | "indistinguishable")
}

/// Measures, calibrates, diagnoses, and compares.
pub(super) fn trial(scenario: &Scenario, plans: &Plans, case: &Case, seed: u64, advice: Advice) -> Result<Outcome, TrialError> {
    let streams = Streams { seed, trial: case.trial() };
    let mut random = streams.stream("suite");
    let mut hidden = hide(case, scenario, plans, &mut random);
    let scenario = scenario.with_truth(hidden.truth(scenario))?;
    let model = &scenario.model;
    let said = Outcome {
        case: case.to_string(),
        class: case.class.clone(),
        kind: hidden.kind,
        hidden: hidden.names(),
        size: hidden.size,
        ..Outcome::default()
    };
    let mut measured = match measure_all(&scenario, streams, plans, &mut ()) {
        Ok(measured) => measured,
        // A robot so wrong that its balls cannot be centred has shown it without any diagnosis.
        Err(RunError::Campaign(_)) => return Ok(Outcome { verdict: "not_measured", ..said }),
        Err(e) => return Err(e.into()),
    };
    disturb(&mut measured.fit, case, &hidden);
    let data = [("fit", &measured.fit)];
    let examination = Examination::new(&data, model)?;
    let diagnosis = diagnose_examined(&data, &examination)?;
    let poses: Vec<Vec<f64>> = measured.validation.samples.iter().map(|s| s.q.clone()).collect();
    let predicted = WorkspaceError::predict(&data, &examination, &diagnosis.relevance, &poses)?;
    let end = measured.fit.samples.iter().filter_map(|s| s.time_s).reduce(f64::max);
    let truth = at_truth(&measured.validation, &measured.validation_truth, end);
    let error = |calibration: &Calibration| -> Result<f64, IdentifyError> {
        let prediction = calibration.predict(&[("truth", &truth)], Use::Validation)?;
        Ok(Validation::of(&prediction).map_or(f64::NAN, |v| v.mean / MM))
    };
    // What the data cannot test they do not see: it is no contributor.
    let untestable = |id: &str| diagnosis.untestable.iter().any(|u| u.effect == id);
    let testable = !hidden.effects.iter().any(|(id, _)| untestable(id));
    hidden.effects.retain(|(id, _)| hidden.kind == "one" || !untestable(id));
    let visible = examination.visible_rms(&data, &hidden.effects).unwrap_or_default();

    let claimed = diagnosis.findings.first().filter(|_| claims(diagnosis.verdict.name()));
    let with_claimed = claimed.and_then(|f| identify(&data, &model.with(&f.hypothesis.in_model)).ok());
    let chi2_left = with_claimed.as_ref().map(|c| c.chi2_per_dof);
    let advised = advised(&data, model, with_claimed, &poses, advice);
    let before_mm = error(&examination.calibration(&data))?;
    let after_mm = advised.as_ref().map_or(Ok(before_mm), |a| error(&a.calibration))?;
    let with_hidden = || {
        let model = hidden.effects.iter().fold(model.clone(), |m, (id, _)| m.with(id));
        identify(&data, &model).and_then(|c| error(&c)).ok()
    };
    let known = matches!(case.kind, Kind::Effects { .. } | Kind::Outliers { .. });
    let [low, high] = predicted.as_ref().map_or([f64::NAN; 2], |w| [w.mean.low / MM, w.mean.high / MM]);
    let expected_after = advised.as_ref().and_then(|a| a.expected_mm);
    Ok(Outcome {
        case: said.case,
        class: said.class,
        kind: said.kind,
        hidden: said.hidden,
        size: said.size,
        visible: visible.iter().map(|v| v * v).sum::<f64>().sqrt(),
        testable,
        before_mm,
        predicted_mm: predicted.map_or(f64::NAN, |w| w.mean.expected / MM),
        predicted_low_mm: low,
        predicted_high_mm: high,
        after_mm: Some(after_mm),
        oracle_mm: known.then(with_hidden).flatten(),
        predicted_after_mm: expected_after.map(|e| e[0]),
        predicted_after_low_mm: expected_after.map(|e| e[1]),
        predicted_after_high_mm: expected_after.map(|e| e[2]),
        ..answer(&diagnosis, case, &hidden, &visible, chi2_left)
    })
}

/// The validation poses with the TCP where it truly was, at the end of the session: what drifts has drifted by then.
fn at_truth(validation: &Dataset, truth: &[Vector3<f64>], end: Option<f64>) -> Dataset {
    let mut data = validation.clone();
    for (sample, at) in data.samples.iter_mut().zip(truth) {
        sample.measured = Measured::Point(*at);
        sample.time_s = end;
    }
    data
}
