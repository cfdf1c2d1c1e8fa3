//! Steps of a ladder, and `calibench-step/2`, printed by `add`.

use calibench::diagnosis;
use calibench::effects::EffectId;
use calibench::effects::registry::Registry;
use calibench::identify::calibration::Estimate;
use calibench::residuals;
use calibench::selection;
use calibench::selection::Objection;
use calibench::units::MM;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Workspace, finite, format_tag, ids};
use crate::finding_notes::{found, parted_by};
use crate::ladder_sentences::{added_words, objection_sentence, symptom_sentence};

format_tag!(StepFormat, "calibench-step/2");

/// Onset of an effect of time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Moment {
    /// The session; null if there is only one.
    pub session: Option<String>,
    /// The samples before and after.
    pub between: [String; 2],
    /// The first and last sample of the 95 % credible range.
    pub between_95: [String; 2],
}

/// Notes on an added effect in addition to its size.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct EffectNote {
    /// Id of the effect.
    pub effect: String,
    /// Effects with exactly the same columns in these data.
    pub exactly_same: Vec<String>,
    /// The measurement that would separate it from these.
    pub parted_by: Option<String>,
    /// Time of a step; null for other effects.
    pub moment: Option<Moment>,
}

/// A parameter of an added effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AddedParameter {
    /// Name.
    pub name: String,
    /// Id of the effect.
    pub effect: String,
    /// Estimate, in `unit`.
    pub value: f64,
    /// One-sigma, in `unit`; null if undetermined.
    pub sigma: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
}

/// Position errors in short.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ErrorSummary {
    /// Number of rows.
    pub samples: usize,
    /// Mean, mm.
    pub mean_mm: f64,
    /// Largest, mm.
    pub max_mm: f64,
    /// Standard deviation, mm.
    pub std_mm: f64,
    /// Root mean square, mm.
    pub rms_mm: f64,
}

/// Errors of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SessionErrors {
    /// Name of the session.
    pub name: String,
    /// Cross-validated error, rms, mm.
    pub cross_validated_mm: f64,
    /// Error when predicted from the other sessions, rms, mm; null if not predicted.
    pub from_others_rms_mm: Option<f64>,
}

/// Errors on a dataset that was not fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CheckErrors {
    /// Name of the dataset.
    pub name: String,
    /// The errors; null if it could not be predicted.
    pub errors: Option<ErrorSummary>,
    /// Reason why it could not be predicted.
    pub refused: Option<String>,
}

/// Gain of a model for one division of the postures into blocks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gain {
    /// The division: `postures`, `places` or `campaigns`.
    pub held_out_by: String,
    /// Number of postures held out.
    pub postures: usize,
    /// Held-out error before, rms, mm.
    pub before_mm: f64,
    /// Held-out error after, rms, mm.
    pub after_mm: f64,
    /// Relative gain.
    pub gain: Option<f64>,
    /// Its one-sigma.
    pub gain_sigma: Option<f64>,
}

/// A model of a ladder, fitted and judged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LadderStep {
    /// Effects added to the step before.
    pub added: Vec<String>,
    /// The same in words.
    pub added_words: String,
    /// Notes on the added effects.
    pub added_notes: Vec<EffectNote>,
    /// Parameters of the added effects.
    pub parameters: Vec<AddedParameter>,
    /// Effects of the model.
    pub effects: Vec<String>,
    /// Residual of the fit, rms, mm.
    pub residual_mm: f64,
    /// Error of blocks of postures left out one by one, rms, mm.
    pub cross_validated_mm: f64,
    /// Sum of squared residuals over the noise, per degree of freedom; null without a stated noise.
    pub chi2_per_dof: Option<f64>,
    /// Error expected over the workspace; null if it cannot be predicted.
    pub workspace: Option<Workspace>,
    /// Parameters of the set-up that the data do not determine.
    pub undetermined: Vec<String>,
    /// Errors on the validation rows; null without any.
    pub validation: Option<ErrorSummary>,
    /// The part of the noise that remains in the residual, mm.
    pub noise_left_mm: f64,
    /// Errors by session.
    pub sessions: Vec<SessionErrors>,
    /// Errors on the datasets given as checks.
    pub checks: Vec<CheckErrors>,
    /// Parameters with values that are not physical, in words.
    pub symptoms: Vec<String>,
    /// Gains over the step before, by division of the postures.
    pub gains: Vec<Gain>,
    /// Verdict of the diagnosis of this model.
    pub verdict: String,
    /// Its 95 % credible set.
    pub set95: Vec<String>,
}

/// One step, printed by `add`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Step {
    /// Format tag.
    pub format: StepFormat,
    /// The model before.
    pub before: LadderStep,
    /// The model with the effect.
    pub after: LadderStep,
    /// Objections to the step, in words.
    pub objections: Vec<String>,
    /// True if the step was accepted.
    pub accepted: bool,
    /// Warning that the data do not fit the robot, if used nevertheless.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<String>,
}

impl Moment {
    pub(super) fn of(m: &diagnosis::hypotheses::Moment) -> Self {
        Moment { session: m.session.clone(), between: m.between.clone(), between_95: m.credible.clone() }
    }
}

impl EffectNote {
    /// The notes on the effects `added`, where there are any; `below` holds the earlier steps in order.
    fn all(added: &[EffectId], below: &[&selection::ladder::LadderStep], registry: &Registry) -> Vec<Self> {
        let noted = found(added, below).filter(|f| f.hypothesis.moment.is_some() || !f.exactly_same.is_empty());
        let one = |f: &diagnosis::Finding| EffectNote {
            effect: f.hypothesis.in_model.to_string(),
            exactly_same: ids(&f.exactly_same),
            parted_by: parted_by(f, registry),
            moment: f.hypothesis.moment.as_ref().map(Moment::of),
        };
        noted.map(one).collect()
    }
}

impl ErrorSummary {
    pub(crate) fn of(v: &residuals::Validation) -> Self {
        ErrorSummary { samples: v.samples, mean_mm: v.mean / MM, max_mm: v.max / MM, std_mm: v.std / MM, rms_mm: v.rms / MM }
    }
}

impl CheckErrors {
    fn of(c: &selection::hold_out::Check) -> Self {
        CheckErrors {
            name: c.name.clone(),
            errors: c.result.as_ref().ok().map(ErrorSummary::of),
            refused: c.result.as_ref().err().map(ToString::to_string),
        }
    }
}

impl Gain {
    pub(super) fn of(gain: &selection::recommend::Gain) -> Self {
        Gain {
            held_out_by: gain.division.name().into(),
            postures: gain.postures,
            before_mm: gain.rms[0] / MM,
            after_mm: gain.rms[1] / MM,
            gain: finite(gain.share),
            gain_sigma: finite(gain.sigma),
        }
    }
}

impl LadderStep {
    /// The documents of the steps of a ladder, in order.
    #[must_use]
    pub fn all(steps: &[&selection::ladder::LadderStep]) -> Vec<Self> {
        (0..steps.len()).map(|k| LadderStep::of(steps[k], &steps[..k])).collect()
    }

    /// The document of a step; the diagnoses of the earlier ones, `below`, give details of the effects it adds.
    #[must_use]
    pub fn of(step: &selection::ladder::LadderStep, below: &[&selection::ladder::LadderStep]) -> Self {
        let session = |s: &selection::SessionError| SessionErrors {
            name: s.name.clone(),
            cross_validated_mm: s.cross_validated / MM,
            from_others_rms_mm: s.from_others.map(|v| v / MM),
        };
        let parameter = |e: &Estimate| AddedParameter {
            name: e.name.clone(),
            effect: e.effect.to_string(),
            value: e.unit.from_si(e.value),
            sigma: finite(e.unit.from_si(e.sigma)),
            unit: e.unit.symbol.into(),
        };
        let added = step.calibration.estimates.iter().filter(|e| step.added.contains(&e.effect));
        LadderStep {
            added: ids(&step.added),
            added_words: added_words(&step.added),
            added_notes: EffectNote::all(&step.added, below, &step.model.registry),
            parameters: added.map(parameter).collect(),
            effects: step.model.ids(),
            residual_mm: step.fit / MM,
            cross_validated_mm: step.cross_validated / MM,
            chi2_per_dof: step.calibration.noise_stated.then_some(step.chi2_per_dof).and_then(finite),
            workspace: step.workspace.as_ref().map(Workspace::of),
            undetermined: step.undetermined.clone(),
            validation: step.validation.as_ref().map(ErrorSummary::of),
            noise_left_mm: step.noise / MM,
            sessions: step.sessions.iter().map(session).collect(),
            checks: step.checks.iter().map(CheckErrors::of).collect(),
            symptoms: step.symptoms.iter().map(symptom_sentence).collect(),
            gains: step.gains.iter().map(Gain::of).collect(),
            verdict: step.diagnosis.verdict.name().into(),
            set95: ids(&step.diagnosis.set95),
        }
    }
}

impl Step {
    /// The document of one step: the models before and after it, the objections to it, and whether it was accepted.
    #[must_use]
    pub fn of(
        before: &selection::ladder::LadderStep,
        after: &selection::ladder::LadderStep,
        objections: &[Objection],
        accepted: bool,
    ) -> Self {
        Step {
            format: StepFormat::Current,
            before: LadderStep::of(before, &[]),
            after: LadderStep::of(after, &[before]),
            objections: objections.iter().map(objection_sentence).collect(),
            accepted,
            misfit: None,
        }
    }
}
