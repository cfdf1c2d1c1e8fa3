//! A fitted and judged model: the parts of a page that do not need individual samples.

use std::sync::Arc;

use serde_json::{Map, Value, json};

use super::candidate::{self, Offered};
use super::pictures::CellPicture;
use super::residuals::MOST_POINTS;
use super::{CampaignRecord, FORMAT, PageSubject, shorts};
use crate::diagnosis_sentences::lacking_words;
use crate::disagreement_sentence;
use crate::documents;
use crate::effect_names::capital;
use crate::figures;
use crate::first_screen::stage_name;
use crate::meaning::meaning;
use crate::row_order::supposed_words;
use crate::workspace::extrapolation_sentence;
use crate::{
    Forecast, NoForecast, abnormal_sentences, masses_sentence, symptom_sentence, unconverged_sentence, unresolved_sentences,
};
use calibench::diagnosis::Verdict;
use calibench::effects::variable_in_words;
use calibench::identify::Prediction;
use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::problem::Use;
use calibench::judgement::{ErrorTable, Stage};
use calibench::measure::dataset::{NamedDataset, SampleSet};
use calibench::prediction::worker::Worker;
use calibench::prediction::{Extrapolation, PoseSource, WorkspacePoses};
use calibench::residuals::Validation;
use calibench::robot::JointKind;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{LadderStep, ladder_step};
use calibench::selection::{FitScores, FittedModel};
use calibench::units::{DEG, MM};

/// A fitted model of a page's data, and the poses on which it is judged.
pub struct PageModel {
    /// The model, fitted and judged.
    pub ladder_step: LadderStep,
    poses: Arc<WorkspacePoses>,
    worker: Option<&'static dyn Worker>,
}

impl PageModel {
    /// Fits the subject's model and judges it.
    ///
    /// # Errors
    /// If data and model do not match, or the data do not determine the unknowns.
    pub fn new(subject: &PageSubject<'_>) -> Result<Self, IdentifyError> {
        let poses = PageModel::poses(subject);
        let ground = HoldOut { poses: &poses, checks: &[], worker: subject.worker };
        let ladder_step = judge(ladder_step(subject.datasets, subject.model, ground)?, subject)?;
        Ok(PageModel { ladder_step, poses, worker: subject.worker })
    }

    /// Judges a fitted model of the subject at these poses; the result is that of [`PageModel::new`] for the same model.
    ///
    /// # Errors
    /// As [`PageModel::new`].
    pub fn of_fitted(
        fitted: FittedModel,
        subject: &PageSubject<'_>,
        poses: Arc<WorkspacePoses>,
    ) -> Result<Self, IdentifyError> {
        let ground = HoldOut { poses: &poses, checks: &[], worker: subject.worker };
        let ladder_step = judge(fitted.judge(subject.datasets, ground)?, subject)?;
        Ok(PageModel { ladder_step, poses, worker: subject.worker })
    }

    /// The poses at which models of these data are judged: those of the validation rows, of `judged` or else of `datasets`;
    /// random ones if there are none.
    pub fn poses(subject: &PageSubject<'_>) -> Arc<WorkspacePoses> {
        let poses = WorkspacePoses::of(subject.judged);
        let drawn = poses.source == PoseSource::Limits;
        Arc::new(if drawn { WorkspacePoses::of(subject.datasets) } else { poses })
    }

    /// The figures of a fit that are known before it is judged, by their keys in a step of the ladder.
    ///
    /// # Errors
    /// If the validation rows cannot be predicted.
    pub fn first_figures(scores: &FitScores, subject: &PageSubject<'_>) -> Result<Value, IdentifyError> {
        let predicted = |rows| scores.calibration.predict(rows, Use::Validation);
        let validation = has_validation(subject.judged).then(|| predicted(subject.judged)).transpose()?;
        let validation = validation.as_ref().and_then(Validation::of);
        Ok(json!({
            "residual_mm": scores.fit / MM,
            "cross_validated_mm": scores.cross_validated / MM,
            "validation": validation.as_ref().map(documents::ErrorSummary::of),
        }))
    }

    /// The effects that may be added, by the id a model accepts, most credible first.
    pub fn candidates(&self) -> Vec<String> {
        Offered::all(&self.ladder_step.model, &self.ladder_step.diagnosis).into_iter().map(|o| o.effect.into()).collect()
    }

    /// The same as the ground of a step.
    pub fn ground(&self) -> HoldOut<'_> {
        HoldOut { poses: &self.poses, checks: &[], worker: self.worker }
    }

    /// The expected error over the workspace, if it can be predicted.
    pub(super) fn forecast(&self) -> Option<Forecast> {
        self.ladder_step.workspace.clone().map(|error| {
            let of_poses = self.poses.q.iter().map(Vec::as_slice);
            let calibration = &self.ladder_step.calibration;
            let extrapolation = Extrapolation::of(&calibration.robot, &calibration.joint_ranges, &calibration.model, of_poses);
            Forecast { error, extrapolation }
        })
    }

    /// The document of a page without its [`super::Views`]; `ladder` is the ladder as a document.
    ///
    /// # Errors
    /// If the validation rows cannot be predicted.
    pub fn json(&self, subject: &PageSubject<'_>, ladder: Value) -> Result<Value, IdentifyError> {
        let PageSubject { datasets, judged, .. } = subject;
        let LadderStep { calibration, diagnosis, .. } = &self.ladder_step;
        let forecast = self.forecast();
        let rows = if has_validation(judged) { judged } else { datasets };
        let errors = ErrorTable::of(rows, calibration, None);
        let states = subject.judgement.map_or_else(|| documents::BeforeAndAfter::of(&errors, None), |j| j.errors.clone());
        let mut document = json!({
            "format": FORMAT,
            "title": subject.title,
            "question": subject.question,
            "robot": calibration.robot.name,
            "verdict": verdict(&self.ladder_step, forecast.as_ref(), subject.judgement),
            "figures": key_figures(&self.ladder_step, forecast.as_ref()),
            "names": figures::names(self.poses.source),
            "states": states,
            "judgement": subject.judgement,
            "commands_from": subject.commands_from,
            "diagnosis": documents::Diagnosis::of(diagnosis, forecast.as_ref()),
            "meanings": candidate::meanings(diagnosis, &ladder),
            "calibration": flagged(fitted(calibration), &self.ladder_step),
            "ladder": ladder,
            "drawn": nominal(calibration, rows, &errors)?,
            "validation": self.ladder_step.validation.as_ref().map(documents::Validation::of),
            "workspace": forecast.as_ref().map(|o| workspace(o, calibration, judged)).transpose()?,
            "campaign": subject.campaign.map(CampaignRecord::json),
            "pictures": subject.pictures.iter().map(CellPicture::json).collect::<Vec<_>>(),
            "run": subject.run,
            "provenance": provenance(datasets, judged),
        });
        if let Some(misfit) = &subject.misfit {
            document["misfit"] = json!(misfit);
        }
        if let Some(sentence) = masses_sentence(&calibration.robot) {
            document["masses"] = json!(sentence);
        }
        let mut meanings = document["meanings"].take();
        candidate::add_spoken_of(&document, &diagnosis.registry, &mut meanings);
        document["meanings"] = meanings;
        Ok(document)
    }
}

/// The verdict as a headline, its meaning, and the expected error of the robot. With the judgement of a ladder that recommends the
/// model, its cause is the headline: that is what was missing before.
fn verdict(first: &LadderStep, forecast: Option<&Forecast>, judgement: Option<&documents::Judged>) -> Value {
    let d = &first.diagnosis;
    let named =
        || d.findings.iter().filter(|f| d.set95.contains(&f.hypothesis.effect)).map(|f| f.hypothesis.in_model.to_string());
    let curve = d.heat_map.credible().first().map(|cell| (cell.joint + 1, cell.variable.name(), cell.explains));
    // The ids of the effects that the headline names.
    let effects: Vec<String> = match d.verdict {
        Verdict::Identified => named().take(1).collect(),
        Verdict::Partly => d.findings.first().map(|f| f.hypothesis.in_model.to_string()).into_iter().collect(),
        Verdict::Indistinguishable => named().collect(),
        _ => Vec::new(),
    };
    let first_words = || effects.first().map_or_else(String::new, |effect| d.registry.in_words(effect));
    let physics = || effects.first().map_or_else(String::new, |effect| sentence(meaning(&d.registry, effect).physics));
    let (headline, means) = match d.verdict {
        Verdict::NoiseLargerThanStated => (
            "The residual is noise, and more of it than stated".to_owned(),
            "State the noise as it is, or measure targets twice to know it.".to_owned(),
        ),
        Verdict::SuspectSamples => {
            let samples: Vec<&str> = d.scatter.suspects.iter().map(|s| s.sample.as_str()).collect();
            (
                format!("Samples that disagree with all others: {}", samples.join(", ")),
                "Look there first; everything else is computed without them.".to_owned(),
            )
        }
        Verdict::DataDoNotFit => (
            "These data do not fit this robot".to_owned(),
            "Everything below was computed anyway, and says little until the data are corrected.".to_owned(),
        ),
        Verdict::NothingLeft if d.is_thin() => (
            "Too few samples to find anything".to_owned(),
            "Nothing is significant in these data, but hardly anything could be: measure more postures.".to_owned(),
        ),
        Verdict::NothingLeft => (
            "The residual is noise".to_owned(),
            "No effect of the catalogue is significant in these data. That does not prove accuracy where nothing was measured."
                .to_owned(),
        ),
        Verdict::Identified => (format!("Missing in the model: {}", first_words()), physics()),
        Verdict::Partly => {
            // A name such as "gear ripple of joint 2, 17 per turn" ends in an apposition.
            let words = first_words();
            let comma = if words.contains(", ") { "," } else { "" };
            let share = 100.0 * d.explains.unwrap_or(0.0);
            (format!("{}{comma} explains {share:.0} %; more is missing", capital(&words)), physics())
        }
        Verdict::Indistinguishable => {
            let all: Vec<String> = effects.iter().map(|effect| d.registry.in_words(effect)).collect();
            (format!("Missing in the model: {}", all.join("; or ")), "These data cannot tell which.".to_owned())
        }
        Verdict::Unexplained => match (supposed_words(d), curve) {
            (Some(event), _) => (
                capital(&event),
                "Everything below is computed without the times of the rows: give them, and what happened is allowed for."
                    .to_owned(),
            ),
            (None, Some((joint, variable, share))) => (
                format!("Unexplained: the error of joint {joint} follows the {}", variable_in_words(&variable)),
                format!(
                    "No single effect of the catalogue explains the residual; a smooth curve of that joint explains {:.0} % of it.",
                    100.0 * share
                ),
            ),
            (None, None) => (
                "Unexplained: many small effects, none of them unusual".to_owned(),
                "The residual is the usual model discrepancy of a robot beyond the fitted model.".to_owned(),
            ),
        },
        other => (capital(&other.in_words()), String::new()),
    };
    let (headline, means) = match first.calibration.unconverged() {
        Some(outcome) => ("The fit did not converge".to_owned(), sentence(&unconverged_sentence(outcome))),
        None => (headline, means),
    };
    let (headline, means) = match abnormal_sentences(&d.abnormal).as_slice() {
        [] => (headline, means),
        [first, others @ ..] => {
            let (what, remedy) = first.split_once(": ").unwrap_or((first.as_str(), ""));
            let rest = [sentence(remedy.trim_end_matches('.')), others.join(" "), format!("{headline}."), means];
            (what.to_owned(), rest.iter().filter(|part| !part.is_empty()).map(String::as_str).collect::<Vec<_>>().join(" "))
        }
    };
    let found = judgement.filter(|j| j.errors.recommended.mean_mm.is_some());
    let (headline, means, effects) = match found {
        None => (headline, means, effects),
        Some(found) => {
            let (what, remedy) = found.cause.split_once(": ").unwrap_or((&found.cause, ""));
            let rest = format!("With the recommended model: {}.", lacking_words(d));
            let means = [sentence(remedy), rest].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ");
            // The name of a parameter stays as it is written everywhere.
            let is_name = what.split(' ').next().is_some_and(|word| word.ends_with(|c: char| c.is_ascii_digit()));
            (if is_name { what.to_owned() } else { capital(what) }, means, Vec::new())
        }
    };
    json!({
        "name": d.verdict.name(),
        "words": d.verdict.in_words(),
        "effects": effects,
        "headline": headline,
        "means": means,
        "expected": forecast.map_or_else(|| NoForecast::of(&first.undetermined).to_string(), Forecast::sentence),
        "warning": forecast.and_then(|o| extrapolation_sentence(&o.extrapolation)),
        "symptoms": first.symptoms.iter().map(symptom_sentence).collect::<Vec<_>>(),
    })
}

/// Turns a clause into a sentence: initial capital and full stop.
fn sentence(clause: &str) -> String {
    if clause.is_empty() { String::new() } else { format!("{}.", capital(clause)) }
}

/// The key figures.
pub(super) fn key_figures(first: &LadderStep, forecast: Option<&Forecast>) -> Value {
    let d = &first.diagnosis;
    json!({
        "samples": d.samples,
        "residual_mm": d.rms / MM,
        "noise_left_mm": d.noise / MM,
        "unexplained_mm": d.unexplained / MM,
        "noise_stated": d.lack_of_fit_p.is_some(),
        "expected": forecast.map(documents::Workspace::of_forecast),
        "validation": first.validation.as_ref().map(documents::Validation::of),
        "disagreement": forecast.and_then(|f| disagreement_sentence(first, f.extrapolation.outside)),
    })
}

/// The calibration with the details shown only on a page.
pub(super) fn fitted(c: &Calibration) -> Value {
    let mut value = documents::to_value(&documents::Calibration::of(c));
    let free: Vec<usize> = (0..c.estimates.len()).filter(|&k| c.estimates[k].stated_sigma.is_none()).collect();
    let rows = free.iter().map(|&r| free.iter().map(|&k| (c.correlation[(r, k)] * 1000.0).round() / 1000.0).collect());
    value["correlation"] = json!(rows.collect::<Vec<Vec<f64>>>());
    value["unresolved_sentences"] = json!(unresolved_sentences(c));
    let ranges = c.joint_ranges.iter().zip(&c.robot.links);
    value["joint_ranges"] = ranges
        .enumerate()
        .filter(|(_, (_, link))| link.mdh.kind == JointKind::Revolute)
        .map(|(k, (range, link))| {
            let limits = link.limits.map(|x| x / DEG);
            json!({"joint": k + 1, "identified_deg": range.map(|x| x / DEG), "limits_deg": limits})
        })
        .collect();
    value
}

/// The same with a warning beside each parameter whose value is physically impossible.
pub(super) fn flagged(mut calibration: Value, step: &LadderStep) -> Value {
    for parameter in calibration["parameters"].as_array_mut().into_iter().flatten() {
        let symptom = step.symptoms.iter().find(|s| parameter["name"] == s.parameter.as_str());
        if let Some(symptom) = symptom {
            parameter["warning"] = json!(symptom_sentence(symptom));
        }
    }
    calibration
}

/// True if there are validation rows.
pub(super) fn has_validation(datasets: &[NamedDataset<'_>]) -> bool {
    datasets.iter().any(|d| d.dataset.samples.iter().any(|s| s.set == SampleSet::Validation))
}

/// A step of the ladder with its position errors on the validation rows.
pub(super) fn judge(mut ladder_step: LadderStep, subject: &PageSubject<'_>) -> Result<LadderStep, IdentifyError> {
    if subject.misfit.is_some() {
        ladder_step.diagnosis.doubt();
    }
    if !has_validation(subject.judged) {
        return Ok(ladder_step);
    }
    let validation = Validation::of(&ladder_step.calibration.predict(subject.judged, Use::Validation)?);
    Ok(LadderStep { validation, ..ladder_step })
}

/// Position errors of the nominal robot on the validation rows or, without any, on the fit rows: as delivered, if that is how the
/// table of `errors` knows it; once its base is fitted, if nobody stated how it stands.
fn nominal(calibration: &Calibration, rows: &[NamedDataset<'_>], errors: &ErrorTable) -> Result<Value, IdentifyError> {
    let as_delivered = errors.errors(Stage::AsDelivered).is_some() && !errors.by_commands;
    let nominal = if as_delivered { calibration.nominal() } else { calibration.nominal().set_up_anew() };
    let held_out = has_validation(rows);
    let which = if held_out { Use::Validation } else { Use::Fit };
    let (prediction, calibrated) = (nominal.predict(rows, which)?, calibration.predict(rows, which)?);
    let errors = Validation::of(&prediction);
    Ok(json!({
        "name": stage_name(if as_delivered { Stage::AsDelivered } else { Stage::Nominal }),
        "on": if held_out { "validation" } else { "fit" },
        "errors": errors.as_ref().map(documents::Validation::of),
        "by_pose": by_pose(&prediction, &calibrated),
    }))
}

/// The error of every pose before and after the calibration, mm; of very many poses, evenly chosen ones.
fn by_pose(nominal: &Prediction, calibrated: &Prediction) -> Value {
    let stride = nominal.residuals.len().div_ceil(MOST_POINTS).max(1);
    let lengths = |p: &Prediction| shorts(p.residuals.iter().step_by(stride).map(|r| r.norm() / MM));
    json!({"of": nominal.residuals.len(), "before_mm": lengths(nominal), "after_mm": lengths(calibrated)})
}

/// The poses of the predicted error and, if measured at them, a map of the measured error.
fn workspace(forecast: &Forecast, calibration: &Calibration, judged: &[NamedDataset<'_>]) -> Result<Value, IdentifyError> {
    let poses = &forecast.error.poses;
    let stride = poses.len().div_ceil(MOST_POINTS).max(1);
    let mut measured = None;
    if forecast.error.at == PoseSource::Validation {
        let prediction = calibration.predict(judged, Use::Validation)?;
        let mut error = forecast.error.clone();
        error.poses.iter_mut().zip(&prediction.residuals).for_each(|(pose, residual)| pose.error = residual.norm());
        // For a set-up refitted to these poses the residual is only a spread, smaller than the error.
        measured = prediction
            .refitted
            .is_empty()
            .then(|| error.map().cells.iter().map(|row| documents::MapCell::row(row)).collect::<Vec<_>>());
    }
    Ok(json!({
        "poses_are": forecast.poses(),
        "radius_mm": shorts(poses.iter().step_by(stride).map(|p| p.radius / MM)),
        "height_mm": shorts(poses.iter().step_by(stride).map(|p| p.height / MM)),
        "measured": measured,
    }))
}

fn provenance(datasets: &[NamedDataset<'_>], judged: &[NamedDataset<'_>]) -> Value {
    let further = judged.iter().filter(|d| !datasets.iter().any(|of| of.name == d.name));
    let of_dataset = |NamedDataset { name, dataset: d }: &NamedDataset<'_>| {
        let count = |set: SampleSet| d.samples.iter().filter(|s| s.set == set).count();
        let free: Map<String, Value> =
            d.provenance.iter().map(|(key, value)| (key.clone(), json!(value.to_string()))).collect();
        json!({"name": name, "sha256": d.hash, "fit_rows": count(SampleSet::Fit), "validation_rows": count(SampleSet::Validation),
            "stated": free})
    };
    json!({
        "program": concat!("calibench ", env!("CARGO_PKG_VERSION")),
        "charts": "Apache ECharts 6.1.0 (Apache-2.0)",
        "datasets": datasets.iter().chain(further).map(of_dataset).collect::<Vec<_>>(),
    })
}
