//! One step of a ladder: a model fitted to the data, and its comparison with the model before it.

use super::READILY;
use crate::diagnosis::Examination;
use crate::diagnosis::Symptom;
use crate::diagnosis::{Diagnosis, diagnose_examined};
use crate::effects::EffectId;
use crate::identify::Model;
use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::problem::Use;
use crate::measure::dataset::{NamedDataset, SampleSet};
use crate::prediction::field::HeldField;
use crate::prediction::{WorkspaceError, undetermined};
use crate::residuals::Validation;
use crate::selection::Objection;
use crate::selection::hold_out::{Check, HoldOut};
use crate::selection::objections::{Compared, Scored};
use crate::selection::recommend::Gain;
use crate::selection::recommend::steps::gains;
use crate::selection::{FitScores, SessionError};

/// A model fitted to the data, with every available measure of its quality.
#[derive(Debug, Clone)]
pub struct LadderStep {
    /// Effects added to the model before it; empty for the first.
    pub added: Vec<EffectId>,
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
    /// Squared errors on these rows, m², in their order; empty if there are none.
    pub held_out: Vec<f64>,
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

/// Fits a model and judges it.
///
/// # Errors
/// When the data do not fit the model, or do not determine the unknowns.
pub fn ladder_step(datasets: &[NamedDataset<'_>], model: &Model, ground: HoldOut<'_>) -> Result<LadderStep, IdentifyError> {
    let examination = Examination::new(datasets, model)?;
    examined_rung(datasets, model, &examination, ground)
}

/// As [`ladder_step`], for a model that is already fitted.
pub(super) fn examined_rung(
    datasets: &[NamedDataset<'_>],
    model: &Model,
    examination: &Examination,
    ground: HoldOut<'_>,
) -> Result<LadderStep, IdentifyError> {
    let field = HeldField::of_model(datasets, model);
    examined_with_field(datasets, model, examination, field.as_ref(), ground)
}

/// The same with the field that the model holds, found from these data.
pub(super) fn examined_with_field(
    datasets: &[NamedDataset<'_>],
    model: &Model,
    examination: &Examination,
    field: Option<&HeldField>,
    ground: HoldOut<'_>,
) -> Result<LadderStep, IdentifyError> {
    judged_rung(datasets, examination, FitScores::of(datasets, model, examination, field)?, field, ground)
}

/// The same with the scores of the fit.
pub(crate) fn judged_rung(
    datasets: &[NamedDataset<'_>],
    examination: &Examination,
    scores: FitScores,
    field: Option<&HeldField>,
    ground: HoldOut<'_>,
) -> Result<LadderStep, IdentifyError> {
    let diagnosis = diagnose_examined(datasets, examination)?;
    let workspace = match field {
        Some(field) => field.workspace(datasets, ground.poses)?,
        None => WorkspaceError::predict_with(datasets, examination, ground.poses, ground.worker)?,
    };
    let FitScores { model, calibration, fit, cross_validated, blocks, posture, sessions, symptoms } = scores;
    let has = |set: SampleSet| datasets.iter().any(|d| d.dataset.samples.iter().any(|s| s.set == set));
    let measured = if has(SampleSet::Validation) { Some(calibration.predict(datasets, Use::Validation)?) } else { None };
    let held_out = measured.iter().flat_map(|m| m.residuals.iter().map(|r| r.norm_squared())).collect();
    let validation = measured.as_ref().and_then(Validation::of);
    Ok(LadderStep {
        added: Vec::new(),
        model,
        fit,
        chi2_per_dof: diagnosis.chi2_per_dof,
        cross_validated,
        blocks,
        posture,
        workspace,
        undetermined: undetermined(examination),
        validation,
        held_out,
        noise: diagnosis.noise,
        sessions,
        diagnosis,
        checks: ground.checks.iter().map(|NamedDataset { name, dataset }| Check::of(&calibration, name, dataset)).collect(),
        symptoms,
        calibration,
        gains: Vec::new(),
    })
}

impl LadderStep {
    /// The parts by which a step is judged.
    pub(crate) fn scored(&self) -> Scored<'_> {
        Scored {
            blocks: &self.blocks,
            posture: &self.posture,
            sessions: &self.sessions,
            checks: &self.checks,
            held_out: &self.held_out,
            workspace: self.workspace.as_ref(),
            diagnosis: Some(&self.diagnosis),
        }
    }

    fn compared<'a>(&'a self, below: &'a LadderStep) -> Compared<'a> {
        Compared { added: &self.added, gains: &self.gains, before: below.scored(), after: self.scored() }
    }

    /// Objection to excluding suspects for good.
    pub(super) fn objection_of_the_others(&self, below: &LadderStep) -> Option<Objection> {
        self.compared(below).objection_of_the_others()
    }

    /// True if the campaign has so few postures that it would miss this many samples.
    pub(super) fn would_miss(&self, samples: usize) -> bool {
        self.scored().would_miss(samples)
    }

    /// The step with the smallest error at rows that were not fitted; the last one if there are none, `None` of no step.
    pub(crate) fn best_measured(steps: &[LadderStep]) -> Option<&Self> {
        let sum = |step: &LadderStep| step.held_out.iter().sum::<f64>();
        steps.iter().rev().reduce(|best, step| if sum(step) < sum(best) { step } else { best })
    }

    /// Objection that rows that were not fitted are predicted worse than by an earlier step.
    pub(crate) fn measured_worse_than(&self, earlier: &LadderStep) -> Option<Objection> {
        self.compared(earlier).objection_of_the_measured()
    }

    /// Objections to the step from `below` to this model.
    pub fn objections(&self, below: &LadderStep) -> Vec<Objection> {
        self.compared(below).objections()
    }
}

/// Adds effects to the model of a step and judges the result.
///
/// # Errors
/// As [`ladder_step`].
pub fn add(
    datasets: &[NamedDataset<'_>],
    below: &LadderStep,
    effects: &[EffectId],
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
    datasets: &[NamedDataset<'_>],
    below: &LadderStep,
    model: &Model,
    added: Vec<EffectId>,
    ground: HoldOut<'_>,
) -> Result<LadderStep, IdentifyError> {
    above(datasets, below, model, added, || ladder_step(datasets, model, ground))
}

/// As [`step`], for a model that a ladder may recommend: its fit must converge readily.
///
/// # Errors
/// As [`ladder_step`], and [`IdentifyError::Slow`].
pub(super) fn readily_step(
    datasets: &[NamedDataset<'_>],
    below: &LadderStep,
    model: &Model,
    added: Vec<EffectId>,
    ground: HoldOut<'_>,
) -> Result<LadderStep, IdentifyError> {
    above(datasets, below, model, added, || readily_fitted(datasets, model, ground))
}

/// Fits and judges a model whose fit converges readily.
///
/// # Errors
/// As [`ladder_step`], and [`IdentifyError::Slow`].
pub(super) fn readily_fitted(
    datasets: &[NamedDataset<'_>],
    model: &Model,
    ground: HoldOut<'_>,
) -> Result<LadderStep, IdentifyError> {
    let examination = Examination::within_steps(datasets, model, READILY)?.ok_or(IdentifyError::Slow { steps: READILY })?;
    examined_rung(datasets, model, &examination, ground)
}

/// The step from `below` to a model that adds `added`, fitted by `fitted`.
fn above(
    datasets: &[NamedDataset<'_>],
    below: &LadderStep,
    model: &Model,
    added: Vec<EffectId>,
    fitted: impl FnOnce() -> Result<LadderStep, IdentifyError>,
) -> Result<LadderStep, IdentifyError> {
    let gains = gains(datasets, &below.model, model)?;
    Ok(LadderStep { added, gains, ..fitted()? })
}
