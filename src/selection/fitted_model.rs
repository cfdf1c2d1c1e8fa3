//! A model that is fitted but not yet judged: the scores of its fit are known long before its diagnosis.

use std::sync::Arc;

use super::fit_scores::FitScores;
use super::hold_out::HoldOut;
use super::ladder::LadderStep;
use super::ladder::step::judged_rung;
use super::objections::{Compared, Objection, Scored};
use super::recommend::Gain;
use super::recommend::steps::gains;
use crate::diagnosis::Examination;
use crate::effects::{self, EffectId};
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::prediction::field::HeldField;

/// A fitted model with its scores.
pub struct FittedModel {
    examination: Examination,
    field: Option<HeldField>,
    /// The scores of the fit.
    pub scores: Arc<FitScores>,
}

impl FittedModel {
    /// Fits a model to the rows of set `fit`.
    ///
    /// # Errors
    /// If data and model do not match, or the data do not determine the unknowns.
    pub fn new(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Self, IdentifyError> {
        let examination = Examination::with(datasets, model, Vec::new())?;
        let field = HeldField::of_model(datasets, model);
        let scores = FitScores::of(datasets, model, &examination, field.as_ref())?;
        Ok(FittedModel { scores: Arc::new(scores), examination, field })
    }

    /// Judges the fit, with the result of [`super::ladder::ladder_step`].
    ///
    /// # Errors
    /// As [`super::ladder::ladder_step`].
    pub fn judge(self, datasets: &[NamedDataset<'_>], ground: HoldOut<'_>) -> Result<LadderStep, IdentifyError> {
        let examination = self.examination.with_library(datasets)?;
        judged_rung(datasets, &examination, (*self.scores).clone(), self.field.as_ref(), ground)
    }
}

impl FitScores {
    fn scored(&self) -> Scored<'_> {
        Scored {
            blocks: &self.blocks,
            posture: &self.posture,
            sessions: &self.sessions,
            checks: &[],
            held_out: &[],
            workspace: None,
            diagnosis: None,
        }
    }

    /// Objections to the step that adds effects to the model of `before`; `below` is that model judged, where it is. The error
    /// expected over the workspace, which refuses no step, is not looked at.
    pub fn objections(
        &self,
        added: &[EffectId],
        gains: &[Gain],
        before: &FitScores,
        below: Option<&LadderStep>,
    ) -> Vec<Objection> {
        let before = below.map_or_else(|| before.scored(), LadderStep::scored);
        Compared { added, gains, before, after: self.scored() }.objections()
    }
}

/// True if a step can be judged only after the diagnosis of the model before it, which may advise it.
pub fn needs_diagnosis(added: &[EffectId]) -> bool {
    added.iter().any(|effect| effects::catalogue::set_aside_by(effect).is_some())
}

/// Gains of the step from one model to a larger one, as [`super::ladder::step`] computes them.
///
/// # Errors
/// When an effect does not fit the data, or a matrix cannot be factored.
pub fn step_gains(datasets: &[NamedDataset<'_>], before: &Model, after: &Model) -> Result<Vec<Gain>, IdentifyError> {
    gains(datasets, before, after)
}
