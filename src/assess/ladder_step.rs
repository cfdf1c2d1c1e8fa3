//! A model on the data, and whether it is better than the one before it.

use super::Validation;
use super::cross_validation::{cross_validated, folds};
use super::diagnosis::{Diagnosis, diagnose_examined};
use super::examination::Examination;
use super::hold_out::{Check, HoldOut};
use super::recommend::{Division, Gain, gains, postures};
use super::symptoms::Symptom;
use super::withdrawal::Contradiction;
use super::workspace::{WorkspaceError, undetermined};
use crate::effects;
use crate::identify::{Calibration, IdentifyError, Model, Use, identify};
use crate::measure::{Dataset, Postures, SampleSet};

/// A fall of the cross-validated rms, or of the predicted error, by less than this share is none.
const A_FALL: f64 = 0.005;

/// Setting samples aside is worth their loss when the others' error falls by this share.
const WORTH_A_SAMPLE: f64 = 0.05;

/// Where samples set aside are as large a part of the postures, the others must gain surely: of few postures each is missed.
const MISSED: usize = 40;

/// A campaign gets worse when its error grows by more than this share.
const WORSE: f64 = 0.01;

/// Error of one session under cross-validation.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionError {
    /// Dataset, and session within it where sessions are named.
    pub name: String,
    /// Root mean square of its 3-D residual, predicted from the rest of the data in blocks, m.
    pub cross_validated: f64,
    /// The same predicted by a robot calibrated on the other campaigns alone, its own base and tool refitted, m; with one campaign none.
    pub from_others: Option<f64>,
    /// Squared errors of that prediction, m², in the order of its rows, and the posture of each.
    squares: Vec<f64>,
    posture: Vec<usize>,
}

/// A model on the data, and how good it is in every respect that can be told.
#[derive(Debug, Clone)]
pub struct LadderStep {
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
    /// Squared residual of each sample when its block was not fitted, m², with its name.
    pub blocks: Vec<(String, f64)>,
    /// The posture of each, counted from 0.
    pub posture: Vec<usize>,
    /// Position error predicted over the workspace.
    pub workspace: Option<WorkspaceError>,
    /// Numbers of the set-up for want of which it cannot be predicted, by name.
    pub undetermined: Vec<String>,
    /// Position errors on rows of set `validation`, where there are any.
    pub validation: Option<Validation>,
    /// What noise alone would leave, m.
    pub noise: f64,
    /// Session by session.
    pub sessions: Vec<SessionError>,
    /// What the data say is missing in it.
    pub diagnosis: Diagnosis,
    /// What was fitted.
    pub calibration: Calibration,
    /// Campaigns that were not fitted, in the order in which they were named.
    pub checks: Vec<Check>,
    /// Numbers that no arm can have.
    pub symptoms: Vec<Symptom>,
    /// What the step gains at postures left out, one entry a division; empty for the first rung, and for a sample that is set aside.
    pub gains: Vec<Gain>,
}

/// What speaks against a step.
#[derive(Debug, Clone, PartialEq)]
pub enum Objection {
    /// What it gains at postures left out is too little, or not sure.
    Gain(Gain),
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
    /// A campaign is predicted worse by the robot of the others, by more than the error of that judgement.
    Campaign {
        /// Its name.
        name: String,
        /// How much worse.
        by: Contradiction,
    },
    /// A campaign that was not fitted is predicted worse, by more than the error of that judgement.
    Check {
        /// Its name.
        name: String,
        /// How much worse.
        by: Contradiction,
    },
    /// A campaign that was not fitted cannot be judged any more.
    CheckUnjudged {
        /// Its name.
        name: String,
        /// Why.
        because: String,
    },
    /// The data do not determine the model.
    NotFitted {
        /// Why.
        because: String,
    },
}

impl Objection {
    /// Whether campaigns speak that the step was not fitted to.
    pub fn is_measured_elsewhere(&self) -> bool {
        matches!(self, Objection::Check { .. } | Objection::CheckUnjudged { .. } | Objection::Campaign { .. })
    }

    /// Whether the step is refused for it, not only warned of.
    pub fn refuses(&self) -> bool {
        !matches!(self, Objection::Workspace { .. })
    }
}

/// Fits a model and judges it.
///
/// # Errors
/// When data and model do not go together, or do not determine the unknowns.
pub fn ladder_step(datasets: &[(&str, &Dataset)], model: &Model, ground: HoldOut<'_>) -> Result<LadderStep, IdentifyError> {
    let examination = Examination::new(datasets, model)?;
    examined_rung(datasets, model, &examination, ground)
}

/// As [`ladder_step`], of a model that is fitted already.
pub(super) fn examined_rung(
    datasets: &[(&str, &Dataset)],
    model: &Model,
    examination: &Examination,
    ground: HoldOut<'_>,
) -> Result<LadderStep, IdentifyError> {
    let diagnosis = diagnose_examined(datasets, examination)?;
    let workspace = WorkspaceError::predict(datasets, examination, ground.poses)?;
    let calibration = examination.calibration(datasets);
    let has = |set: SampleSet| datasets.iter().any(|(_, d)| d.samples.iter().any(|s| s.set == set));
    let validation =
        if has(SampleSet::Validation) { Validation::of(&calibration.predict(datasets, Use::Validation)?) } else { None };
    let blocks = blocks(examination);
    let setup_of = examination.circumstances.iter().map(|at| at.setup);
    let of_session =
        |s: usize| rms(blocks.iter().zip(setup_of.clone()).filter(|(_, setup)| *setup == s).map(|((_, squares), _)| *squares));
    let names = examination.problem.setups().iter().map(|s| s.name());
    let names =
        names.map(|[dataset, session]| if session.is_empty() { dataset.to_owned() } else { format!("{dataset}/{session}") });
    let mut sessions: Vec<SessionError> = names
        .enumerate()
        .map(|(s, name)| SessionError {
            name,
            cross_validated: of_session(s),
            from_others: None,
            squares: Vec::new(),
            posture: Vec::new(),
        })
        .collect();
    if datasets.len() > 1 && sessions.len() == datasets.len() {
        for (k, session) in sessions.iter_mut().enumerate() {
            if let Some((squares, posture)) = from_others(datasets, model, k) {
                session.from_others = Some(rms(squares.iter().copied()));
                (session.squares, session.posture) = (squares, posture);
            }
        }
    }
    Ok(LadderStep {
        added: Vec::new(),
        model: model.clone(),
        fit: examination.fit.rms,
        chi2_per_dof: diagnosis.chi2_per_dof,
        // A sample that is set aside counts no more.
        cross_validated: rms(blocks.iter().filter(|(id, _)| !is_aside(model, id)).map(|(_, squares)| *squares)),
        blocks,
        posture: postures(&examination.circumstances).of_samples().to_vec(),
        workspace,
        undetermined: undetermined(examination),
        validation,
        noise: diagnosis.noise,
        sessions,
        diagnosis,
        checks: ground.checks.iter().map(|(name, dataset)| Check::of(&calibration, name, dataset)).collect(),
        symptoms: Symptom::of(&calibration, datasets),
        calibration,
        gains: Vec::new(),
    })
}

/// Whether a model sets a sample aside.
fn is_aside(model: &Model, sample: &str) -> bool {
    model.effects.contains(&effects::setting_aside(sample))
}

/// Squared residual of each sample when its block was not fitted, m², with its name.
fn blocks(examination: &Examination) -> Vec<(String, f64)> {
    let Examination { circumstances, rows, fit, .. } = examination;
    let setups = circumstances.iter().map(|c| c.setup + 1).max().unwrap_or(0);
    let predicted = cross_validated(examination, &folds(circumstances), 0..0);
    let (mut fitted, mut residual) = (vec![0.0; setups], vec![0.0; setups]);
    let last = rows.nrows() - 1;
    for (at, r) in circumstances.iter().zip(examination.problem.residuals(&fit.values)) {
        fitted[at.setup] += (0..at.height).map(|k| rows[(last, at.first_row + k)].powi(2)).sum::<f64>();
        residual[at.setup] += r.norm_squared();
    }
    // Whitened squares compare; the residual itself gives the unit.
    let unit = |s: usize| residual[s] / fitted[s].max(f64::MIN_POSITIVE);
    let squares = circumstances.iter().zip(predicted).map(|(at, squares)| squares * unit(at.setup));
    examination.problem.sample_ids().iter().cloned().zip(squares).collect()
}

/// Root of the mean of some squares.
fn rms(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
}

/// Squared errors of dataset `k` predicted by the robot as the other datasets have it, and the posture of each row; `None` when they do not
/// determine it.
fn from_others(datasets: &[(&str, &Dataset)], model: &Model, k: usize) -> Option<(Vec<f64>, Vec<usize>)> {
    let others: Vec<(&str, &Dataset)> = datasets.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, d)| *d).collect();
    let calibration = identify(&others, model).ok()?;
    let predicted = calibration.predict(&datasets[k..=k], Use::Fit).ok()?;
    let postures = Postures::of(&datasets[k..=k], |s| Use::Fit.takes(s));
    Some((predicted.residuals.iter().map(|r| r.norm_squared()).collect(), postures.of_samples().to_vec()))
}

impl LadderStep {
    /// Samples that the step to it sets aside.
    fn added_aside(&self) -> Vec<&str> {
        self.added.iter().filter_map(|effect| effects::set_aside_by(effect)).collect()
    }

    /// Cross-validated error of the samples that are not set aside, below and here, m.
    fn of_the_others(&self, below: &LadderStep) -> [f64; 2] {
        let aside = self.added_aside();
        [below, self].map(|r| rms(r.blocks_without(&aside).map(|(_, squares)| squares)))
    }

    /// What speaks against setting suspects aside for good: far rows of an arm that errs widely everywhere are no accident, and without
    /// them nothing else is predicted better, of few postures surely so.
    pub(super) fn objection_of_the_others(&self, below: &LadderStep) -> Option<Objection> {
        let rms = self.of_the_others(below);
        if rms[1] > rms[0] * (1.0 - WORTH_A_SAMPLE) {
            return Some(Objection::CrossValidation { rms });
        }
        let aside = self.added_aside();
        if !below.would_miss(aside.len()) {
            return None;
        }
        let [before, after] = [below, self].map(|ladder_step| ladder_step.mean_squares(&aside));
        Gain::of(Division::Time, &before, &after).filter(|gain| !gain.convinces()).map(Objection::Gain)
    }

    /// Whether its postures are so few that it would miss this many samples.
    pub(super) fn would_miss(&self, samples: usize) -> bool {
        samples * MISSED >= self.postures()
    }

    /// How many postures it was judged at.
    fn postures(&self) -> usize {
        self.posture.iter().max().map_or(0, |p| p + 1)
    }

    /// Posture and cross-validated square of each sample, m², without these.
    fn blocks_without(&self, samples: &[&str]) -> impl Iterator<Item = (usize, f64)> {
        let of_all = self.posture.iter().zip(&self.blocks);
        of_all.filter(|(_, (id, _))| !samples.contains(&id.as_str())).map(|(posture, (_, squares))| (*posture, *squares))
    }

    /// Mean cross-validated square of each posture, m², without these samples; `None` of a posture of which none is left.
    fn mean_squares(&self, without: &[&str]) -> Vec<Option<f64>> {
        let mut sums = vec![(0.0, 0.0); self.postures()];
        for (posture, squares) in self.blocks_without(without) {
            let (sum, count) = &mut sums[posture];
            (*sum, *count) = (*sum + squares, *count + 1.0);
        }
        sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect()
    }

    /// What speaks against having climbed here from `below`.
    pub fn objections(&self, below: &LadderStep) -> Vec<Objection> {
        let mut all = Vec::new();
        // A sample that the step sets aside is nothing that it could predict: the others must not be predicted worse for it.
        let aside = self.added_aside();
        let sets_aside = !aside.is_empty() && aside.len() == self.added.len();
        // Beside a second bad sample the first may seem to help the others; the diagnosis has judged them together.
        let advised = sets_aside && aside.iter().all(|sample| below.diagnosis.advises_to_set_aside(sample));
        let squares = self.of_the_others(below);
        // One that nothing speaks against is a measurement like any other.
        let enough = 1.0 - if sets_aside { WORTH_A_SAMPLE } else { A_FALL };
        all.extend(self.gains.iter().find(|gain| !gain.convinces()).copied().map(Objection::Gain));
        if self.gains.is_empty() && !advised && squares[1] > squares[0] * enough {
            all.push(Objection::CrossValidation { rms: squares });
        }
        // Of one session that has been said.
        let several = self.sessions.len() > 1 && !sets_aside;
        for (before, after) in below.sessions.iter().zip(&self.sessions).filter(|_| several) {
            let name = after.name.clone();
            if let Some(by) = Contradiction::of(&before.squares, &after.squares, &after.posture) {
                all.push(Objection::Campaign { name, by });
            } else if self.gains.is_empty() && after.cross_validated > before.cross_validated * (1.0 + WORSE) {
                all.push(Objection::Session { name, rms: [before.cross_validated, after.cross_validated] });
            }
        }
        for (before, after) in below.checks.iter().zip(&self.checks) {
            let name = after.name.clone();
            match (&before.result, &after.result) {
                (Ok(_), Ok(_)) => {
                    let by = Contradiction::of(&before.squares, &after.squares, &after.posture);
                    all.extend(by.map(|by| Objection::Check { name, by }));
                }
                (Ok(_), Err(because)) => all.push(Objection::CheckUnjudged { name, because: because.clone() }),
                _ => {}
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

/// Adds effects to the model of a rung and judges the result.
///
/// # Errors
/// As [`ladder_step`].
pub fn add(
    datasets: &[(&str, &Dataset)],
    below: &LadderStep,
    effects: &[String],
    ground: HoldOut<'_>,
) -> Result<LadderStep, IdentifyError> {
    let model = effects.iter().fold(below.model.clone(), |model, effect| model.with(effect));
    step(datasets, below, &model, effects.to_vec(), ground)
}

/// Fits a model that adds `added` to that of a rung, and judges it as a step from there.
///
/// # Errors
/// As [`ladder_step`].
pub fn step(
    datasets: &[(&str, &Dataset)],
    below: &LadderStep,
    model: &Model,
    added: Vec<String>,
    ground: HoldOut<'_>,
) -> Result<LadderStep, IdentifyError> {
    let gains = gains(datasets, &below.model, model)?;
    let ladder_step = ladder_step(datasets, model, ground)?;
    Ok(LadderStep { added, gains, ..ladder_step })
}
