//! One blind trial.

use calibench::assess::{Diagnosis, Examination, Validation, Verdict, WorkspaceError, diagnose_examined};
use calibench::effects::{self, Subject};
use calibench::files::FileError;
use calibench::identify::{Calibration, IdentifyError, Model, Use, identify};
use calibench::measure::{Dataset, Measured};
use calibench::units::MM;
use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::Serialize;
use thiserror::Error;

use super::{Case, Kind};
use crate::random::Streams;
use crate::run::{Plans, RunError, measure_all};
use crate::scenario::{Scenario, written_sizes};

/// A flaw of one plausible size, rms over the workspace: what a joint's error of unknown origin is like.
const UNKNOWN_RMS_URAD: f64 = 60.0;

/// A probing takes about so long in the simulated cell, s: only to draw moments within the session.
const PROBING_S: f64 = 12.5;

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
}

/// What came out of one trial: the truth and the answer side by side.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[allow(missing_docs)] // the columns of the table of trials
pub struct Outcome {
    pub case: String,
    /// `nothing`, `one`, `two`, `clutter`, `dense` or `unknown`.
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
    /// Mean position error over the workspace, free of the tracker's noise: of the calibration, as it predicts it itself, with what was
    /// found added, with what is hidden added.
    pub before_mm: f64,
    pub predicted_mm: f64,
    pub after_mm: Option<f64>,
    pub oracle_mm: Option<f64>,
}

impl Outcome {
    /// Whether an effect of the catalogue was claimed.
    pub fn claimed(&self) -> bool {
        [Verdict::Identified, Verdict::Partly, Verdict::Indistinguishable, Verdict::SuspectSamples]
            .iter()
            .any(|v| v.name() == self.verdict)
    }
}

/// An effect as it is hidden: its id, and its true numbers, SI.
type Hidden = (String, Vec<f64>);

/// Measures, calibrates, diagnoses, and compares.
pub(super) fn trial(scenario: &Scenario, plans: &Plans, case: &Case, streams: Streams) -> Result<Outcome, TrialError> {
    let mut random = streams.stream("suite");
    let cell = scenario.dataset();
    let model = &scenario.model;
    let (mut hidden, kind, size) = hide(case, &cell, model, plans, &mut random);
    let mut keys = scenario.truth().keys().clone();
    let balls = cell.ball_ids();
    let subject = Subject::new(&cell.robot, &balls);
    for (id, sizes) in hidden.iter().filter(|(id, _)| !id.starts_with("outlier:")) {
        // Drawn from the catalogue just now.
        let Ok(effect) = effects::build(id, &subject) else { continue };
        keys.effects.entry(id.clone()).or_default().extend(written_sizes(effect.as_ref(), sizes));
    }
    let mut twins = Vec::new();
    let mut joints: Vec<usize> = hidden.iter().filter_map(|(id, _)| joint_of(id)).collect();
    if let Kind::Unknown { flaw, size } = &case.kind {
        let text = format!("[{flaw}]\nrms_urad = {}", size * UNKNOWN_RMS_URAD);
        keys.hidden = toml::from_str(&text).unwrap_or_default();
        joints = keys.hidden.joints();
        twins = keys.hidden.twins();
    }
    let scenario = scenario.with_truth(keys)?;
    let mut measured = match measure_all(&scenario, streams, plans, &mut ()) {
        Ok(measured) => measured,
        // A robot so wrong that its balls cannot be centred has shown it without any diagnosis.
        Err(RunError::Campaign(_)) => {
            let (case, hidden) = (case.kind.to_string(), names(&hidden));
            return Ok(Outcome { case, kind, hidden, size, testable: false, verdict: "not_measured", ..Outcome::default() });
        }
        Err(e) => return Err(e.into()),
    };
    for (id, sizes) in &hidden {
        disturb(&mut measured.fit, id, sizes);
    }
    if let Kind::Nothing { noise_wrong } = case.kind {
        let noise = &mut measured.fit.noise;
        noise.ball = noise.ball.map(|s| s / noise_wrong);
        noise.point = noise.point.map(|s| s / noise_wrong);
        noise.joint.iter_mut().for_each(|s| *s /= noise_wrong);
    }
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
    let with = |ids: &[String]| -> Result<f64, IdentifyError> {
        error(&identify(&data, &ids.iter().fold(model.clone(), |m, id| m.with(id)))?)
    };
    // What the data cannot test they do not see: it is no contributor.
    hidden.retain(|(id, _)| kind == "one" || !diagnosis.untestable.iter().any(|u| u.effect == *id));
    let visible = examination.visible_rms(&data, &hidden).unwrap_or_default();
    let outcome = Outcome {
        case: case.kind.to_string(),
        kind,
        hidden: names(&hidden),
        size,
        visible: visible.iter().map(|v| v * v).sum::<f64>().sqrt(),
        testable: !diagnosis.untestable.iter().any(|u| hidden.iter().any(|(id, _)| *id == u.effect)),
        before_mm: error(&examination.calibration(&data))?,
        predicted_mm: predicted.map_or(f64::NAN, |w| w.mean.expected / MM),
        after_mm: None,
        oracle_mm: None,
        ..answer(&diagnosis, &hidden, &visible, &joints, &twins)
    };
    if !outcome.claimed() || !matches!(kind, "one" | "two") {
        return Ok(outcome);
    }
    let found: Vec<String> = diagnosis.findings.iter().take(1).map(|f| f.hypothesis.in_model.clone()).collect();
    let ids: Vec<String> = hidden.iter().map(|(id, _)| id.clone()).collect();
    Ok(Outcome { after_mm: Some(with(&found)?), oracle_mm: with(&ids).ok(), ..outcome })
}

fn names(hidden: &[Hidden]) -> String {
    if hidden.len() > 2 {
        return "everything".into();
    }
    hidden.iter().map(|(id, _)| id.as_str()).collect::<Vec<_>>().join(" ")
}

/// What the diagnosis says, held against the truth.
fn answer(diagnosis: &Diagnosis, hidden: &[Hidden], visible: &[f64], joints: &[usize], twins: &[String]) -> Outcome {
    let mut set95 = diagnosis.set95.clone();
    if diagnosis.verdict == Verdict::SuspectSamples {
        set95.insert(0, "outlier".into());
    }
    let is_true = |effect: &str| hidden.iter().any(|(id, _)| same(id, effect));
    let top = diagnosis.findings.first();
    let name = |f: &calibench::assess::Finding| f.hypothesis.in_model.clone();
    let top3: Vec<String> = diagnosis.findings.iter().take(3).map(name).collect();
    let top_right = top.is_some_and(|f| is_true(&f.hypothesis.in_model));
    let merged = top_right || top.is_some_and(|f| f.rivals.iter().any(|r| is_true(r)));
    let contributor = diagnosis.contributions.first().map(|c| c.effect.clone()).unwrap_or_default();
    let largest = (0..visible.len()).max_by(|&a, &b| visible[a].total_cmp(&visible[b]));
    let joint = match (diagnosis.verdict, diagnosis.heat_map.best_cell()) {
        (Verdict::Unexplained, Some(cell)) => Some(cell.joint + 1),
        _ => top.and_then(|f| joint_of(&f.hypothesis.in_model)),
    };
    Outcome {
        verdict: diagnosis.verdict.name(),
        top: top.map(name).unwrap_or_default(),
        rivals: top.map(|f| f.rivals.join(" ")).unwrap_or_default(),
        top3_right: top3.iter().any(|e| is_true(e)),
        top3: top3.join(" "),
        set95: set95.join(" "),
        top_right,
        top_right_merged: merged,
        covered: set95.iter().any(|e| is_true(e)),
        joint_right: joint.is_some_and(|j| joints.contains(&j)),
        said_so: diagnosis.verdict == Verdict::Unexplained
            || top.is_some_and(|f| twins.iter().any(|t| same(t, &f.hypothesis.in_model) || f.rivals.iter().any(|r| r == t))),
        contributor_right: largest.is_some_and(|k| same(&hidden[k].0, &contributor)),
        contributor,
        ..Outcome::default()
    }
}

/// Whether two ids name one effect; where a scan finds a moment, any moment will do.
fn same(a: &str, b: &str) -> bool {
    let moment = |id: &str| {
        id.split_once("_step").map(|(kind, rest)| {
            let joint = if kind == "joint" { rest.split(':').nth(1).unwrap_or_default() } else { "" };
            format!("{kind}:{joint}")
        })
    };
    a == b || (moment(a).is_some() && moment(a) == moment(b)) || (a.starts_with("outlier") && b == "outlier")
}

/// The joint that an effect names, counted from 1.
fn joint_of(id: &str) -> Option<usize> {
    let (family, rest) = id.split_once(':')?;
    let of_joint = !["ball", "outlier", "base_step", "tool_step"].contains(&family) && !family.starts_with("gauge");
    rest.split(':').next().filter(|_| of_joint)?.parse().ok()
}

/// Draws what is hidden: effects with their sizes, the kind of trial, the size in plausible ones.
fn hide(
    case: &Case,
    cell: &Dataset,
    model: &Model,
    plans: &Plans,
    random: &mut ChaCha8Rng,
) -> (Vec<Hidden>, &'static str, f64) {
    let balls = cell.ball_ids();
    let subject = Subject::new(&cell.robot, &balls);
    let priors = |id: &str| -> Vec<f64> {
        effects::build(id, &subject).map(|e| e.parameters().iter().map(|p| p.prior).collect()).unwrap_or_default()
    };
    let all = || calibench::assess::Library::of_robot(cell, model).candidates.into_iter().map(|c| c.id);
    match &case.kind {
        Kind::Nothing { .. } => (Vec::new(), "nothing", 0.0),
        Kind::Unknown { size, .. } => (Vec::new(), "unknown", *size),
        Kind::Effects { ids, size } => {
            let hidden = ids.iter().map(|id| {
                let id = placed(id, plans, random);
                let sizes = unit_rms(&priors(&id), random).map(|s| s * size).collect();
                (id, sizes)
            });
            (hidden.collect(), if ids.len() == 1 { "one" } else { "two" }, *size)
        }
        Kind::Clutter { size } => {
            let drawn = |id: String| {
                let sizes = priors(&id).iter().map(|p| size * p * normal(random)).collect();
                (id, sizes)
            };
            (all().map(drawn).collect(), "clutter", *size)
        }
        Kind::Dense => {
            let drawn = |id: String| {
                let size = 0.5 * normal(random).exp();
                let sizes = priors(&id).iter().map(|p| size * p * normal(random)).collect();
                (id, sizes)
            };
            (all().map(drawn).collect(), "dense", 1.0)
        }
    }
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    random.sample(StandardNormal)
}

/// Random numbers of rms one, each times its plausible size.
fn unit_rms(priors: &[f64], random: &mut ChaCha8Rng) -> impl Iterator<Item = f64> + use<> {
    let drawn: Vec<f64> = priors.iter().map(|_| normal(random)).collect();
    let rms = (drawn.iter().map(|d| d * d).sum::<f64>() / drawn.len().max(1) as f64).sqrt();
    let sizes: Vec<f64> = drawn.iter().zip(priors).map(|(d, p)| d / rms * p).collect();
    sizes.into_iter()
}

/// An id with its order, moment or sample drawn.
fn placed(id: &str, plans: &Plans, random: &mut ChaCha8Rng) -> String {
    let Some(stem) = id.strip_suffix('@') else { return id.to_owned() };
    let probings = plans.plan.wanted();
    if stem.starts_with("harmonic") {
        format!("{stem}{}", random.random_range(3..=140))
    } else if stem.starts_with("outlier") {
        format!("{stem}{}", plans.plan.probings[random.random_range(0..probings)].id)
    } else {
        let session = PROBING_S * probings as f64;
        format!("{stem}{:.1}", session * random.random_range(0.2..0.8))
    }
}

/// A centring that ended off the ball by `sizes` (m, world): its left-over reading says nothing of it.
fn disturb(data: &mut Dataset, id: &str, sizes: &[f64]) {
    let Some(name) = id.strip_prefix("outlier:") else { return };
    let offset = Vector3::from_fn(|k, _| sizes.get(k).copied().unwrap_or(0.0));
    for sample in data.samples.iter_mut().filter(|s| s.id == name) {
        if let Measured::Ball { reading: Some(reading), .. } = &mut sample.measured {
            *reading += offset;
        }
    }
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
