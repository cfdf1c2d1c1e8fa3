//! A model fitted and judged: all that a page says of it without looking at every sample.

use serde_json::{Map, Value, json};

use super::candidate::{self, Offered};
use super::pictures::CellPicture;
use super::residuals::MOST_POINTS;
use super::{CampaignRecord, FORMAT, PageSubject, shorts};
use crate::assess::{Extrapolation, MapCell, PoseSource, ProvingGround, Rung, Validation, Verdict, WorkspacePoses, rung};
use crate::identify::{Calibration, IdentifyError, Use};
use crate::measure::{Dataset, SampleSet};
use crate::report::meaning::meaning;
use crate::report::workspace::extrapolation_sentence;
use crate::report::{
    Outlook, calibration_json, diagnosis_json, no_outlook_sentence, symptom_sentence, unconverged_sentence,
    unresolved_sentences, validation_json,
};
use crate::units::{DEG, MM};

/// A model on the data of a page, and the poses on which it is judged.
pub struct Standing {
    /// The model, fitted and judged.
    pub rung: Rung,
    poses: WorkspacePoses,
}

impl Standing {
    /// Fits the subject's model and judges it.
    ///
    /// # Errors
    /// When data and model do not go together, or do not determine the unknowns.
    pub fn new(subject: &PageSubject<'_>) -> Result<Self, IdentifyError> {
        let poses = judged_at(subject);
        let ground = ProvingGround { poses: &poses.q, checks: &[] };
        let rung = judge(rung(subject.datasets, subject.model, ground)?, subject.judged)?;
        Ok(Standing { rung, poses })
    }

    /// What one step more has made of this one, judged on the same poses.
    ///
    /// # Errors
    /// When the rows to judge on cannot be predicted.
    pub fn stepped(&self, rung: Rung, subject: &PageSubject<'_>) -> Result<Self, IdentifyError> {
        Ok(Standing { rung: judge(rung, subject.judged)?, poses: self.poses.clone() })
    }

    /// What may be added, as a model takes it, the most credible first.
    pub fn candidates(&self) -> Vec<String> {
        Offered::all(&self.rung.model, &self.rung.diagnosis).into_iter().map(|o| o.effect).collect()
    }

    /// Where a step has to prove itself.
    pub fn ground(&self) -> ProvingGround<'_> {
        ProvingGround { poses: &self.poses.q, checks: &[] }
    }

    /// The error to expect, where it can be told.
    pub(super) fn outlook(&self) -> Option<Outlook> {
        self.rung.workspace.clone().map(|error| {
            let of_poses = self.poses.q.iter().map(Vec::as_slice);
            let calibration = &self.rung.calibration;
            let extrapolation = Extrapolation::of(&calibration.joint_ranges, &calibration.model, of_poses);
            Outlook { error, source: self.poses.source, extrapolation }
        })
    }

    /// The document of a page, but for its [`super::Views`]; `ladder` is the error falling.
    ///
    /// # Errors
    /// When the rows to judge on cannot be predicted.
    pub fn json(&self, subject: &PageSubject<'_>, ladder: Value) -> Result<Value, IdentifyError> {
        let PageSubject { datasets, judged, commands, .. } = subject;
        let Rung { calibration, diagnosis, .. } = &self.rung;
        let outlook = self.outlook();
        let mut document = json!({
            "format": FORMAT,
            "title": subject.title,
            "question": subject.question,
            "robot": calibration.robot.name,
            "verdict": verdict(&self.rung, outlook.as_ref()),
            "figures": figures(&self.rung, outlook.as_ref()),
            "commands_from": subject.commands_from,
            "diagnosis": diagnosis_json(diagnosis, outlook.as_ref(), commands),
            "meanings": candidate::meanings(diagnosis),
            "calibration": fitted(calibration),
            "ladder": ladder,
            "drawn": drawn(calibration, datasets, judged)?,
            "validation": self.rung.validation.as_ref().map(validation_json),
            "workspace": outlook.as_ref().map(|o| workspace(o, calibration, judged)).transpose()?,
            "campaign": subject.campaign.map(CampaignRecord::json),
            "pictures": subject.pictures.iter().map(CellPicture::json).collect::<Vec<_>>(),
            "run": subject.run,
            "provenance": provenance(datasets, judged),
        });
        if let Some(misfit) = &subject.misfit {
            document["misfit"] = json!(misfit);
        }
        Ok(document)
    }
}

/// The poses of the rows that are judged on; where there are none, drawn ones.
fn judged_at(subject: &PageSubject<'_>) -> WorkspacePoses {
    let poses = WorkspacePoses::of(subject.judged);
    if poses.source == PoseSource::Drawn { WorkspacePoses::of(subject.datasets) } else { poses }
}

/// The verdict as a headline, what it means, and what is to be expected of the robot.
fn verdict(first: &Rung, outlook: Option<&Outlook>) -> Value {
    let d = &first.diagnosis;
    let named = || d.findings.iter().filter(|f| d.set95.contains(&f.hypothesis.effect));
    let first_named = named().next().map(|f| f.hypothesis.in_model.clone());
    let curve = d.heat_map.credible().first().map(|cell| (cell.joint + 1, cell.variable.name()));
    let (headline, means) = match d.verdict {
        Verdict::NoiseLargerThanStated => (
            "Nothing is left but noise, and more of it than stated".to_owned(),
            "State the noise as it is, or measure targets twice to know it.".to_owned(),
        ),
        Verdict::SuspectSamples => {
            let samples: Vec<&str> = d.scatter.suspects.iter().map(|s| s.sample.as_str()).collect();
            (
                format!("Samples that disagree with all others: {}", samples.join(", ")),
                "Look there before anything else; all else is told without them.".to_owned(),
            )
        }
        Verdict::DataDoNotFit => ("These data do not fit this robot".to_owned(), "Nothing is diagnosed.".to_owned()),
        Verdict::NothingLeft => (
            "Nothing is left but noise".to_owned(),
            "No effect of the catalogue sticks out of these data. That is no proof of accuracy where nothing was measured."
                .to_owned(),
        ),
        Verdict::Identified => {
            let effect = first_named.clone().unwrap_or_default();
            (format!("Missing in the model: {effect}"), sentence(meaning(&effect).physics))
        }
        Verdict::Partly => {
            let effect = d.findings.first().map(|f| f.hypothesis.in_model.clone()).unwrap_or_default();
            (
                format!("{effect} explains {:.0} %; more is missing", 100.0 * d.explains.unwrap_or(0.0)),
                sentence(meaning(&effect).physics),
            )
        }
        Verdict::Indistinguishable => {
            let all: Vec<&str> = named().map(|f| f.hypothesis.in_model.as_str()).collect();
            (format!("Missing in the model: one of {}", all.join(", ")), "These data cannot tell which.".to_owned())
        }
        Verdict::Unexplained => match curve {
            Some((joint, variable)) => (
                format!("Unexplained: the error of joint {joint} follows {variable}"),
                "No single effect of the catalogue explains what is left; a smooth curve of that joint takes the most of it."
                    .to_owned(),
            ),
            None => (
                "Unexplained: many ordinary effects, none of them unusual".to_owned(),
                "What is left is what an ordinary robot looks like beyond the fitted model.".to_owned(),
            ),
        },
    };
    let (headline, means) = match first.calibration.unconverged() {
        Some(outcome) => ("The fit did not converge".to_owned(), sentence(&unconverged_sentence(outcome))),
        None => (headline, means),
    };
    json!({
        "name": d.verdict.name(),
        "headline": headline,
        "means": means,
        "expected": outlook.map_or_else(|| no_outlook_sentence(&first.undetermined), Outlook::sentence),
        "warning": outlook.and_then(|o| extrapolation_sentence(&o.extrapolation)),
        "symptoms": first.symptoms.iter().map(symptom_sentence).collect::<Vec<_>>(),
    })
}

/// A clause with a capital and a full stop.
fn sentence(clause: &str) -> String {
    let mut letters = clause.chars();
    letters.next().map_or(String::new(), |first| format!("{}{}.", first.to_uppercase(), letters.as_str()))
}

/// The few numbers that a reader takes along.
fn figures(first: &Rung, outlook: Option<&Outlook>) -> Value {
    let d = &first.diagnosis;
    json!({
        "samples": d.samples,
        "rms_mm": d.rms / MM,
        "noise_mm": d.noise / MM,
        "unexplained_mm": d.unexplained / MM,
        "noise_stated": d.lack_of_fit_p.is_some(),
        "expected": outlook.map(Outlook::json),
        "validation": first.validation.as_ref().map(validation_json),
    })
}

/// The calibration with what only a page has room for.
fn fitted(c: &Calibration) -> Value {
    let mut value = calibration_json(c);
    let free: Vec<usize> = (0..c.estimates.len()).filter(|&k| c.estimates[k].stated_sigma.is_none()).collect();
    let rows = free.iter().map(|&r| free.iter().map(|&k| (c.correlation[(r, k)] * 1000.0).round() / 1000.0).collect());
    value["correlation"] = json!(rows.collect::<Vec<Vec<f64>>>());
    value["unresolved_sentences"] = json!(unresolved_sentences(c));
    let ranges = c.joint_ranges.iter().zip(&c.robot.links);
    value["joint_ranges"] = ranges
        .enumerate()
        .map(|(k, (range, link))| {
            let limits = link.limits.map(|x| x / DEG);
            json!({"joint": k + 1, "identified_deg": range.map(|x| x / DEG), "limits_deg": limits})
        })
        .collect();
    value
}

/// Whether there are rows to judge on.
fn has_validation(datasets: &[(&str, &Dataset)]) -> bool {
    datasets.iter().any(|(_, d)| d.samples.iter().any(|s| s.set == SampleSet::Validation))
}

/// A rung with its position errors on the rows that are judged on.
pub(super) fn judge(rung: Rung, judged: &[(&str, &Dataset)]) -> Result<Rung, IdentifyError> {
    if !has_validation(judged) {
        return Ok(rung);
    }
    let validation = Validation::of(&rung.calibration.predict(judged, Use::Validation)?);
    Ok(Rung { validation, ..rung })
}

/// Position errors of the robot as drawn: on the rows that are judged on, where there are any, else on those of the fit. Of several
/// set-ups no drawing says where each stood; their bases are fitted.
fn drawn(
    calibration: &Calibration,
    datasets: &[(&str, &Dataset)],
    judged: &[(&str, &Dataset)],
) -> Result<Value, IdentifyError> {
    let base_fitted = calibration.setups.len() > 1;
    let drawn = if base_fitted { calibration.as_drawn().set_up_anew() } else { calibration.as_drawn() };
    let held_out = has_validation(judged);
    let prediction = if held_out { drawn.predict(judged, Use::Validation)? } else { drawn.predict(datasets, Use::Fit)? };
    let errors = Validation::of(&prediction);
    Ok(json!({
        "name": if base_fitted { "as drawn, bases fitted" } else { "as drawn" },
        "on": if held_out { "validation" } else { "fit" },
        "errors": errors.as_ref().map(validation_json),
    }))
}

/// Where the predicted error was predicted, and, where it was measured as well, the map of what was measured.
fn workspace(outlook: &Outlook, calibration: &Calibration, judged: &[(&str, &Dataset)]) -> Result<Value, IdentifyError> {
    let poses = &outlook.error.poses;
    let stride = poses.len().div_ceil(MOST_POINTS).max(1);
    let mut measured = None;
    if outlook.source == PoseSource::Validation {
        let prediction = calibration.predict(judged, Use::Validation)?;
        let mut error = outlook.error.clone();
        error.poses.iter_mut().zip(&prediction.residuals).for_each(|(pose, residual)| pose.error = residual.norm());
        let cells = |row: &Vec<Option<MapCell>>| -> Value {
            row.iter().map(|c| c.map_or(Value::Null, |c| json!({"mean_mm": c.error / MM, "poses": c.poses}))).collect()
        };
        // Of a set-up fitted to these very poses a spread is left, less than the error.
        measured = prediction.refitted.is_empty().then(|| error.map().cells.iter().map(cells).collect::<Value>());
    }
    Ok(json!({
        "poses_are": outlook.poses(),
        "radius_mm": shorts(poses.iter().step_by(stride).map(|p| p.radius / MM)),
        "height_mm": shorts(poses.iter().step_by(stride).map(|p| p.height / MM)),
        "measured": measured,
    }))
}

fn provenance(datasets: &[(&str, &Dataset)], judged: &[(&str, &Dataset)]) -> Value {
    let further = judged.iter().filter(|(name, _)| !datasets.iter().any(|(n, _)| n == name));
    let of_dataset = |(name, d): &(&str, &Dataset)| {
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
