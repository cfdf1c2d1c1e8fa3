//! The error falling: a model, one effect more, the same data again; and where to stop.

use super::diagnosis::{Diagnosis, Verdict};
use super::examination::Examination;
use super::heat_map::Curve;
use super::library::Library;
use super::rung::{Objection, ProvingGround, Rung, add, rung};
use crate::effects::{self, Subject};
use crate::identify::{IdentifyError, Model, Use, missing};
use crate::measure::Dataset;

/// Most rungs of a ladder.
const MOST_RUNGS: usize = 16;

/// Findings tried on one rung when none stands out.
const TRIED: usize = 4;

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

/// What a ladder does, as it does it.
#[derive(Debug)]
pub enum Climb<'a> {
    /// An effect is added to the model of the last rung.
    Trying(&'a str),
    /// It does not help.
    Refused(&'a str, &'a [Objection]),
    /// A rung was reached: the first, one more, or, in one step, the whole library.
    Reached(&'a Rung),
    /// The whole library is fitted at once.
    WholeLibrary,
}

/// The hunt from a model to the noise.
#[derive(Debug, Clone)]
pub struct Ladder {
    /// From the model to begin with, upwards.
    pub rungs: Vec<Rung>,
    /// Why it ends.
    pub top: Top,
    /// The whole library fitted to what the first model leaves, in one step; where nothing of the catalogue explains what the last rung
    /// leaves, with the curves of the joints that do. None when nothing is missing.
    pub whole: Option<Rung>,
    /// What speaks against that step, from the last rung.
    pub against_whole: Vec<Objection>,
}

impl Ladder {
    /// The last rung.
    pub fn last(&self) -> &Rung {
        &self.rungs[self.rungs.len() - 1]
    }

    /// The rung to use, and whether it is the whole library: that must promise a lower error over the workspace, which is a matter of what
    /// is thought plausible, and must be a step that would not be refused to a single effect, which is measured. Where one thing is wrong
    /// with a robot and has been found, a hundred more parameters predict what was left out worse.
    pub fn recommended(&self) -> (&Rung, bool) {
        let last = self.last();
        let error = |r: &Rung| r.workspace.as_ref().map_or(r.cross_validated, |w| w.mean.expected);
        let measured_worse = self.against_whole.iter().any(Objection::refuses);
        match &self.whole {
            Some(whole) if error(whole) < error(last) && !measured_worse => (whole, true),
            _ => (last, false),
        }
    }
}

/// Diagnoses, adds, refits, until nothing is left or nothing helps.
///
/// # Errors
/// As [`rung`], of the first model. A step that cannot be fitted is not taken.
pub fn ladder(
    datasets: &[(&str, &Dataset)],
    model: &Model,
    ground: ProvingGround<'_>,
    witness: &mut dyn FnMut(Climb<'_>),
) -> Result<Ladder, IdentifyError> {
    let mut rungs = vec![rung(datasets, model, ground)?];
    witness(Climb::Reached(&rungs[0]));
    let top = loop {
        let below = &rungs[rungs.len() - 1];
        if below.diagnosis.verdict.is_noise() {
            break Top::NothingLeft;
        }
        if rungs.len() > MOST_RUNGS {
            break Top::Tired;
        }
        let mut tried = Vec::new();
        let mut best: Option<Rung> = None;
        for effect in candidates(&below.diagnosis) {
            witness(Climb::Trying(&effect));
            let objections = match add(datasets, below, std::slice::from_ref(&effect), ground) {
                Ok(next) => {
                    let objections = next.objections(below);
                    if objections.is_empty() {
                        let better = best.as_ref().is_none_or(|b| next.cross_validated < b.cross_validated);
                        best = if better { Some(next) } else { best };
                        if below.diagnosis.verdict != Verdict::Unexplained {
                            break;
                        }
                        continue;
                    }
                    objections
                }
                Err(e) => vec![Objection::NotFitted { because: e.to_string() }],
            };
            witness(Climb::Refused(&effect, &objections));
            tried.push((effect, objections));
        }
        match best {
            Some(next) => {
                witness(Climb::Reached(&next));
                rungs.push(next);
            }
            None => break Top::NoStepHelps { tried },
        }
    };
    let last = &rungs[rungs.len() - 1];
    let mut against_whole = Vec::new();
    let whole = if rungs[0].diagnosis.verdict.is_noise() {
        None
    } else {
        witness(Climb::WholeLibrary);
        let curves = if last.diagnosis.verdict == Verdict::Unexplained { curves(datasets, last)? } else { Vec::new() };
        // A library that these data do not determine is no alternative.
        whole_library(datasets, &rungs[0], &curves, ground).ok()
    };
    if let Some(whole) = &whole {
        against_whole = whole.objections(last);
        witness(Climb::Reached(whole));
    }
    Ok(Ladder { rungs, top, whole, against_whole })
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

/// The curves of a rung's joints that are credible, the best variable of each.
fn curves(datasets: &[(&str, &Dataset)], rung: &Rung) -> Result<Vec<Curve>, IdentifyError> {
    let cells = rung.diagnosis.heat_map.credible();
    if cells.is_empty() {
        return Ok(Vec::new());
    }
    let examination = Examination::new(datasets, &rung.model)?;
    let mut curves = Vec::new();
    for cell in cells {
        curves.extend(Curve::of(&examination, cell.joint, cell.variable)?);
    }
    Ok(curves)
}

/// Fits the whole library at once to what a rung leaves, each effect held to the size that the data give it, and `curves` beside it.
///
/// # Errors
/// As [`rung`].
pub fn whole_library(
    datasets: &[(&str, &Dataset)],
    below: &Rung,
    curves: &[Curve],
    ground: ProvingGround<'_>,
) -> Result<Rung, IdentifyError> {
    let examined = Library::new(datasets, &below.model);
    let mut model = below.model.clone();
    let mut added = Vec::new();
    for (candidate, width) in examined.candidates.iter().zip(&below.diagnosis.relevance.width) {
        // The whole family and its members would be there twice; what a check does not hold cannot be judged there.
        let twice = examined.candidates.iter().any(|c| c.family == candidate.id && c.id != candidate.id);
        if twice || !is_judged(&candidate.id, &model, ground) {
            continue;
        }
        model.width.insert(candidate.id.clone(), *width);
        added.push(candidate.id.clone());
    }
    model.effects.extend(added.iter().cloned());
    for curve in curves {
        model = curve.added_to(&model);
        added.push(curve.effect_name());
    }
    let rung = rung(datasets, &model, ground)?;
    Ok(Rung { added, ..rung })
}

/// Whether every check holds what an effect needs.
fn is_judged(id: &str, model: &Model, ground: ProvingGround<'_>) -> bool {
    ground.checks.iter().all(|(_, check)| {
        let balls = check.ball_ids();
        let subject = Subject { own: &model.own, ..Subject::new(&check.robot, &balls) };
        effects::build(id, &subject).is_ok_and(|e| missing(e.as_ref(), check, model, Use::All).is_none())
    })
}
