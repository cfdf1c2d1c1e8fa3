//! The error falling: a model, one effect more, the same data again; and where to stop.

use super::Validation;
use super::cross_validation::{cross_validated, folds};
use super::diagnosis::{Diagnosis, Verdict, diagnose_examined};
use super::examination::Examination;
use super::relevance::Relevance;
use super::workspace::WorkspaceError;
use crate::identify::{Calibration, IdentifyError, Model, Use, identify};
use crate::measure::{Dataset, SampleSet};

/// A fall of the cross-validated rms, or of the predicted error, by less than this share is none.
const A_FALL: f64 = 0.005;

/// A campaign gets worse when its error grows by more than this share.
const WORSE: f64 = 0.01;

/// Most rungs of a ladder.
const MOST_RUNGS: usize = 16;

/// Findings tried on one rung when none stands out.
const TRIED: usize = 4;

/// Error of one session under cross-validation.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionError {
    /// Dataset, and session within it where sessions are named.
    pub name: String,
    /// Root mean square of its 3-D residual, predicted from the rest of the data in blocks, m.
    pub cross_validated: f64,
    /// The same predicted by a robot calibrated on the other campaigns alone, its own base and tool refitted, m; with one campaign none.
    pub from_others: Option<f64>,
}

/// A model on the data, and how good it is in every respect that can be told.
#[derive(Debug, Clone)]
pub struct Rung {
    /// What was added to the model below; empty for the first.
    pub added: Vec<String>,
    /// The model.
    pub model: Model,
    /// Residual, rms in 3-D, m.
    pub fit: f64,
    /// Whitened squares per degree of freedom.
    pub chi2_per_dof: f64,
    /// Residual of blocks that were not fitted, rms in 3-D, m.
    pub cross_validated: f64,
    /// Position error predicted over the workspace.
    pub workspace: Option<WorkspaceError>,
    /// Position errors on rows of set `validation`, where there are any.
    pub validation: Option<Validation>,
    /// What noise alone would leave, m.
    pub noise: f64,
    /// Session by session.
    pub sessions: Vec<SessionError>,
    /// What the data say is missing in it.
    pub diagnosis: Diagnosis,
    /// The whole library fitted to what it leaves.
    pub relevance: Relevance,
    /// What was fitted.
    pub calibration: Calibration,
}

/// What speaks against a step.
#[derive(Debug, Clone, PartialEq)]
pub enum Objection {
    /// Blocks that were not fitted are predicted no better.
    CrossValidation {
        /// Rms before and after, m.
        rms: [f64; 2],
    },
    /// The error predicted over the workspace grows.
    Workspace {
        /// Mean before and after, m.
        mean: [f64; 2],
    },
    /// A campaign is predicted worse.
    Session {
        /// Its name.
        name: String,
        /// Rms before and after, m.
        rms: [f64; 2],
    },
}

impl Objection {
    /// Whether the step is refused for it, not only warned of.
    pub fn refuses(&self) -> bool {
        !matches!(self, Objection::Workspace { .. })
    }
}

/// Fits a model and judges it.
///
/// # Errors
/// When data and model do not go together, or do not determine the unknowns.
pub fn rung(datasets: &[(&str, &Dataset)], model: &Model, poses: &[Vec<f64>]) -> Result<Rung, IdentifyError> {
    let examination = Examination::new(datasets, model)?;
    let diagnosis = diagnose_examined(datasets, &examination)?;
    let relevance = Relevance::new(&examination)?;
    let workspace = WorkspaceError::predict(datasets, &examination, &relevance, poses)?;
    let calibration = examination.calibration(datasets);
    let has = |set: SampleSet| datasets.iter().any(|(_, d)| d.samples.iter().any(|s| s.set == set));
    let validation =
        if has(SampleSet::Validation) { Validation::of(&calibration.predict(datasets, Use::Validation)?) } else { None };
    let (cross_validated, by_session) = blocks(&examination);
    let names = examination.problem.setups().iter().map(|s| s.name());
    let names =
        names.map(|[dataset, session]| if session.is_empty() { dataset.to_owned() } else { format!("{dataset}/{session}") });
    let mut sessions: Vec<SessionError> = names
        .zip(by_session)
        .map(|(name, cross_validated)| SessionError { name, cross_validated, from_others: None })
        .collect();
    if datasets.len() > 1 && sessions.len() == datasets.len() {
        for (k, session) in sessions.iter_mut().enumerate() {
            session.from_others = from_others(datasets, model, k);
        }
    }
    Ok(Rung {
        added: Vec::new(),
        model: model.clone(),
        fit: examination.fit.rms,
        chi2_per_dof: diagnosis.chi2_per_dof,
        cross_validated,
        workspace,
        validation,
        noise: diagnosis.noise,
        sessions,
        diagnosis,
        relevance,
        calibration,
    })
}

/// Rms over blocks that were not fitted, m: of all, and of each session.
fn blocks(examination: &Examination) -> (f64, Vec<f64>) {
    let Examination { circumstances, rows, fit, .. } = examination;
    let folds = folds(circumstances);
    let predicted = cross_validated(examination, &folds, 0..0);
    let mut fitted = vec![0.0; predicted.len()];
    let mut residual = vec![(0.0, 0); predicted.len()];
    let last = rows.nrows() - 1;
    for (at, r) in circumstances.iter().zip(examination.problem.residuals(&fit.values)) {
        fitted[at.setup] += (0..at.height).map(|k| rows[(last, at.first_row + k)].powi(2)).sum::<f64>();
        residual[at.setup].0 += r.norm_squared();
        residual[at.setup].1 += 1;
    }
    // Whitened squares compare; the residual itself gives the unit.
    let of = |s: usize| (residual[s].0 / residual[s].1.max(1) as f64 * predicted[s] / fitted[s].max(f64::MIN_POSITIVE)).sqrt();
    let each: Vec<f64> = (0..predicted.len()).map(of).collect();
    let count: usize = residual.iter().map(|r| r.1).sum();
    let sum: f64 = each.iter().zip(&residual).map(|(rms, r)| rms * rms * r.1 as f64).sum();
    ((sum / count.max(1) as f64).sqrt(), each)
}

/// Rms of dataset `k` predicted by the robot as the other datasets have it; `None` when they do not determine it.
fn from_others(datasets: &[(&str, &Dataset)], model: &Model, k: usize) -> Option<f64> {
    let others: Vec<(&str, &Dataset)> = datasets.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, d)| *d).collect();
    let calibration = identify(&others, model).ok()?;
    Validation::of(&calibration.predict(&datasets[k..=k], Use::Fit).ok()?).map(|v| v.rms)
}

impl Rung {
    /// What speaks against having climbed here from `below`.
    pub fn objections(&self, below: &Rung) -> Vec<Objection> {
        let mut all = Vec::new();
        let rms = [below.cross_validated, self.cross_validated];
        if rms[1] > rms[0] * (1.0 - A_FALL) {
            all.push(Objection::CrossValidation { rms });
        }
        for (before, after) in below.sessions.iter().zip(&self.sessions) {
            let pairs = [
                Some([before.cross_validated, after.cross_validated]),
                before.from_others.zip(after.from_others).map(|(b, a)| [b, a]),
            ];
            for rms in pairs.into_iter().flatten().filter(|[b, a]| *a > b * (1.0 + WORSE)) {
                all.push(Objection::Session { name: after.name.clone(), rms });
            }
        }
        if let (Some(before), Some(after)) = (&below.workspace, &self.workspace) {
            let mean = [before.mean.expected, after.mean.expected];
            if mean[1] > mean[0] * (1.0 - A_FALL) {
                all.push(Objection::Workspace { mean });
            }
        }
        all
    }
}

/// Adds effects to a model and judges the result.
///
/// # Errors
/// As [`rung`].
pub fn add(datasets: &[(&str, &Dataset)], below: &Rung, effects: &[String], poses: &[Vec<f64>]) -> Result<Rung, IdentifyError> {
    let model = effects.iter().fold(below.model.clone(), |model, effect| model.with(effect));
    let rung = rung(datasets, &model, poses)?;
    Ok(Rung { added: effects.to_vec(), ..rung })
}

/// Why a ladder ends.
#[derive(Debug, Clone, PartialEq)]
pub enum Top {
    /// What remains is noise.
    NothingLeft,
    /// No step that was tried lowers both the cross-validated and the predicted error.
    NoStepHelps {
        /// What was tried, and what speaks against it.
        tried: Vec<(String, Vec<Objection>)>,
    },
    /// The most rungs were climbed.
    Tired,
}

/// The hunt from a model to the noise.
#[derive(Debug, Clone)]
pub struct Ladder {
    /// From the model to begin with, upwards.
    pub rungs: Vec<Rung>,
    /// Why it ends.
    pub top: Top,
    /// The whole library fitted to what the first model leaves, in one step.
    pub whole: Option<Rung>,
}

/// Diagnoses, adds, refits, until nothing is left or nothing helps.
///
/// # Errors
/// As [`rung`].
pub fn ladder(
    datasets: &[(&str, &Dataset)],
    model: &Model,
    poses: &[Vec<f64>],
    climbed: &mut dyn FnMut(&Rung),
) -> Result<Ladder, IdentifyError> {
    let mut rungs = vec![rung(datasets, model, poses)?];
    climbed(&rungs[0]);
    let top = loop {
        let below = &rungs[rungs.len() - 1];
        if below.diagnosis.verdict == Verdict::NothingLeft {
            break Top::NothingLeft;
        }
        if rungs.len() > MOST_RUNGS {
            break Top::Tired;
        }
        let mut tried = Vec::new();
        let mut best: Option<Rung> = None;
        for effect in candidates(&below.diagnosis) {
            let next = add(datasets, below, std::slice::from_ref(&effect), poses)?;
            let objections = next.objections(below);
            if objections.is_empty() {
                let better = best.as_ref().is_none_or(|b| next.cross_validated < b.cross_validated);
                best = if better { Some(next) } else { best };
                if below.diagnosis.verdict != Verdict::Unexplained {
                    break;
                }
            } else {
                tried.push((effect, objections));
            }
        }
        match best {
            Some(next) => {
                climbed(&next);
                rungs.push(next);
            }
            None => break Top::NoStepHelps { tried },
        }
    };
    let whole = whole_library(datasets, &rungs[0], poses)?;
    if let Some(whole) = &whole {
        climbed(whole);
    }
    Ok(Ladder { rungs, top, whole })
}

/// What to try next: what sticks out, and what contributes most.
fn candidates(diagnosis: &Diagnosis) -> Vec<String> {
    let found = diagnosis.findings.iter().map(|f| f.hypothesis.in_model.clone());
    if diagnosis.verdict != Verdict::Unexplained {
        return found.take(TRIED).collect();
    }
    let contributing = diagnosis.contributions.iter().map(|c| c.effect.clone());
    let mut all: Vec<String> = contributing.take(TRIED).chain(found.take(TRIED)).collect();
    let mut seen = std::collections::BTreeSet::new();
    all.retain(|e| seen.insert(e.clone()));
    all
}

/// Fits the whole library at once, each effect held to the size that the data give it; `None` when nothing is missing.
///
/// # Errors
/// As [`rung`].
pub fn whole_library(datasets: &[(&str, &Dataset)], below: &Rung, poses: &[Vec<f64>]) -> Result<Option<Rung>, IdentifyError> {
    if below.diagnosis.verdict == Verdict::NothingLeft {
        return Ok(None);
    }
    let examined = super::library::Library::new(datasets, &below.model);
    let mut model = below.model.clone();
    let mut added = Vec::new();
    for (candidate, width) in examined.candidates.iter().zip(&below.relevance.width) {
        // The whole family and its members would be there twice.
        if examined.candidates.iter().any(|c| c.family == candidate.id && c.id != candidate.id) {
            continue;
        }
        model.width.insert(candidate.id.clone(), *width);
        added.push(candidate.id.clone());
    }
    model.effects.extend(added.iter().cloned());
    let rung = rung(datasets, &model, poses)?;
    Ok(Some(Rung { added, ..rung }))
}
