//! One step of a ladder: a model fitted to the data, and its comparison with the model before it.

use super::Validation;
use super::cross_validation::{cross_validated_positions, folds};
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

/// Smallest share by which the cross-validated rms or the predicted error must decrease to count as an improvement.
const A_FALL: f64 = 0.005;

/// Share by which the error of the other samples must decrease to justify setting samples aside.
const WORTH_A_SAMPLE: f64 = 0.05;

/// If at least one sample in this many postures is set aside, the gain of the others must be significant: with few
/// postures, every one is missed.
const MISSED: usize = 40;

/// Share by which the error of a campaign must increase to count as worse.
const WORSE: f64 = 0.01;

/// Cross-validated error of one session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionError {
    /// Name of the dataset, with the session if sessions are named.
    pub name: String,
    /// Root mean square of its 3-D residual in blocked cross-validation, m.
    pub cross_validated: f64,
    /// Rms of the 3-D error predicted by a robot calibrated on the other campaigns only, with its own base and tool
    /// refitted, m; `None` with one campaign, or if the others do not determine the robot.
    pub from_others: Option<f64>,
    /// Squared errors of that prediction, m², in the order of its rows, and the posture index of each.
    squares: Vec<f64>,
    posture: Vec<usize>,
}

/// A model fitted to the data, with every available measure of its quality.
#[derive(Debug, Clone)]
pub struct LadderStep {
    /// Effects added to the model before it; empty for the first.
    pub added: Vec<String>,
    /// The model.
    pub model: Model,
    /// Residual, rms in 3-D, m.
    pub fit: f64,
    /// Whitened sum of squares per degree of freedom.
    pub chi2_per_dof: f64,
    /// Residual in blocked cross-validation, rms in 3-D, m.
    pub cross_validated: f64,
    /// Name of each sample, and its squared residual in blocked cross-validation, m².
    pub blocks: Vec<(String, f64)>,
    /// Posture index of each sample, counted from 0.
    pub posture: Vec<usize>,
    /// Position error expected over the workspace.
    pub workspace: Option<WorkspaceError>,
    /// Undetermined set-up parameters, by name; with any, the workspace error cannot be predicted.
    pub undetermined: Vec<String>,
    /// Position errors on rows of set `validation`, if there are any.
    pub validation: Option<Validation>,
    /// Part of the rms due to noise, m.
    pub noise: f64,
    /// One entry per session.
    pub sessions: Vec<SessionError>,
    /// Diagnosis of what the model is missing.
    pub diagnosis: Diagnosis,
    /// The fit as a calibration.
    pub calibration: Calibration,
    /// Campaigns that were not fitted, in the order given.
    pub checks: Vec<Check>,
    /// Parameter values that are physically impossible.
    pub symptoms: Vec<Symptom>,
    /// Gain of the step at left-out postures, one entry per division; empty for the first model, and if a sample is set
    /// aside.
    pub gains: Vec<Gain>,
}

/// An objection to a step.
#[derive(Debug, Clone, PartialEq)]
pub enum Objection {
    /// The gain at left-out postures is too small, or not significant.
    Gain(Gain),
    /// Blocks that were not fitted are not predicted better.
    CrossValidation {
        /// Rms before and after, m.
        rms: [f64; 2],
    },
    /// The error expected over the workspace does not decrease.
    Workspace {
        /// Mean before and after, m.
        mean: [f64; 2],
    },
    /// A session is predicted worse.
    Session {
        /// Its name.
        name: String,
        /// Rms before and after, m.
        rms: [f64; 2],
    },
    /// A campaign is predicted significantly worse by the robot calibrated on the others.
    Campaign {
        /// Its name.
        name: String,
        /// Size and significance of the increase.
        by: Contradiction,
    },
    /// A campaign that was not fitted is predicted significantly worse.
    Check {
        /// Its name.
        name: String,
        /// Size and significance of the increase.
        by: Contradiction,
    },
    /// A campaign that was not fitted can no longer be judged.
    CheckUnjudged {
        /// Its name.
        name: String,
        /// Reason.
        because: String,
    },
    /// The data do not determine the model.
    NotFitted {
        /// Reason.
        because: String,
    },
}

impl Objection {
    /// True if the objection comes from campaigns that the step was not fitted to.
    pub fn is_measured_elsewhere(&self) -> bool {
        matches!(self, Objection::Check { .. } | Objection::CheckUnjudged { .. } | Objection::Campaign { .. })
    }

    /// True if the step is refused because of it; false if it is only a warning.
    pub fn refuses(&self) -> bool {
        !matches!(self, Objection::Workspace { .. })
    }
}

/// Fits a model and judges it.
///
/// # Errors
/// When the data do not fit the model, or do not determine the unknowns.
pub fn ladder_step(datasets: &[(&str, &Dataset)], model: &Model, ground: HoldOut<'_>) -> Result<LadderStep, IdentifyError> {
    let examination = Examination::new(datasets, model)?;
    examined_rung(datasets, model, &examination, ground)
}

/// As [`ladder_step`], for a model that is already fitted.
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
        // A sample that is set aside no longer counts.
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

/// True if a model sets a sample aside.
fn is_aside(model: &Model, sample: &str) -> bool {
    model.effects.contains(&effects::setting_aside(sample))
}

/// Name of each sample, and its squared residual in blocked cross-validation, m².
fn blocks(examination: &Examination) -> Vec<(String, f64)> {
    let Examination { circumstances, rows, fit, .. } = examination;
    let setups = circumstances.iter().map(|c| c.setup + 1).max().unwrap_or(0);
    let predicted = cross_validated_positions(examination, &folds(circumstances));
    let (mut fitted, mut residual) = (vec![0.0; setups], vec![0.0; setups]);
    let last = rows.nrows() - 1;
    for (at, r) in circumstances.iter().zip(examination.problem.residuals(&fit.values)) {
        fitted[at.setup] += (0..at.positions).map(|k| rows[(last, at.first_row + k)].powi(2)).sum::<f64>();
        residual[at.setup] += r.norm_squared();
    }
    // The squares are computed whitened; the ratio of residual to whitened squares of the set-up converts them to m².
    let unit = |s: usize| residual[s] / fitted[s].max(f64::MIN_POSITIVE);
    let squares = circumstances.iter().zip(predicted).map(|(at, squares)| squares * unit(at.setup));
    examination.problem.sample_ids().iter().cloned().zip(squares).collect()
}

/// Root mean square, from squared values.
fn rms(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
}

/// Squared errors of dataset `k` predicted by a robot calibrated on the other datasets, and the posture index of each
/// row; `None` if the others do not determine it.
fn from_others(datasets: &[(&str, &Dataset)], model: &Model, k: usize) -> Option<(Vec<f64>, Vec<usize>)> {
    let others: Vec<(&str, &Dataset)> = datasets.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, d)| *d).collect();
    let calibration = identify(&others, model).ok()?;
    let predicted = calibration.predict(&datasets[k..=k], Use::Fit).ok()?;
    let postures = Postures::of(&datasets[k..=k], |s| Use::Fit.takes(s));
    Some((predicted.residuals.iter().map(|r| r.norm_squared()).collect(), postures.of_samples().to_vec()))
}

impl LadderStep {
    /// Samples that this step sets aside.
    fn added_aside(&self) -> Vec<&str> {
        self.added.iter().filter_map(|effect| effects::set_aside_by(effect)).collect()
    }

    /// Cross-validated rms error of the samples that are not set aside, before and after the step, m.
    fn of_the_others(&self, below: &LadderStep) -> [f64; 2] {
        let aside = self.added_aside();
        [below, self].map(|r| rms(r.blocks_without(&aside).map(|(_, squares)| squares)))
    }

    /// Objection to setting suspects aside for good. If an arm has large errors everywhere, distant rows are no
    /// accident, and removing them does not improve the prediction of the others; with few postures, the improvement
    /// must be significant.
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

    /// True if the campaign has so few postures that it would miss this many samples.
    pub(super) fn would_miss(&self, samples: usize) -> bool {
        samples * MISSED >= self.postures()
    }

    /// Number of postures at which it was judged.
    fn postures(&self) -> usize {
        self.posture.iter().max().map_or(0, |p| p + 1)
    }

    /// Posture index and cross-validated squared residual of each sample, m², except for these.
    fn blocks_without(&self, samples: &[&str]) -> impl Iterator<Item = (usize, f64)> {
        let of_all = self.posture.iter().zip(&self.blocks);
        of_all.filter(|(_, (id, _))| !samples.contains(&id.as_str())).map(|(posture, (_, squares))| (*posture, *squares))
    }

    /// Mean cross-validated squared residual of each posture, m², without these samples; `None` for a posture with no
    /// other sample.
    fn mean_squares(&self, without: &[&str]) -> Vec<Option<f64>> {
        let mut sums = vec![(0.0, 0.0); self.postures()];
        for (posture, squares) in self.blocks_without(without) {
            let (sum, count) = &mut sums[posture];
            (*sum, *count) = (*sum + squares, *count + 1.0);
        }
        sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect()
    }

    /// Objections to the step from `below` to this model.
    pub fn objections(&self, below: &LadderStep) -> Vec<Objection> {
        let mut all = Vec::new();
        // A sample that is set aside need not be predicted; the others must not be predicted worse because of it.
        let aside = self.added_aside();
        let sets_aside = !aside.is_empty() && aside.len() == self.added.len();
        // With a second bad sample present, setting the first aside may not seem to help; the diagnosis has judged them
        // together.
        let advised = sets_aside && aside.iter().all(|sample| below.diagnosis.advises_to_set_aside(sample));
        let squares = self.of_the_others(below);
        // A sample is set aside only for a clear improvement; otherwise it is a measurement like any other.
        let enough = 1.0 - if sets_aside { WORTH_A_SAMPLE } else { A_FALL };
        all.extend(self.gains.iter().find(|gain| !gain.convinces()).copied().map(Objection::Gain));
        if self.gains.is_empty() && !advised && squares[1] > squares[0] * enough {
            all.push(Objection::CrossValidation { rms: squares });
        }
        // With one session, this is the cross-validation above.
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
                (Ok(_), Err(because)) => all.push(Objection::CheckUnjudged { name, because: because.to_string() }),
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

/// Adds effects to the model of a step and judges the result.
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

/// Fits a model that adds `added` to the model of `below`, and judges it as a step from there.
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
