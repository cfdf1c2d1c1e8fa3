//! `calibench-ladder/3`, printed by `ladder`.

use calibench::selection;
use calibench::selection::ladder::{RefusedStep, StopReason};
use calibench::units::MM;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FleetUsed, Gain, LadderStep, OutsideRange, format_tag, ids, joined};
use crate::field::{shares_sentence, unused_sentence};
use crate::ladder_sentences::{advice, objection_sentence, why};

format_tag!(LadderFormat, "calibench-ladder/3");

/// One of the compared models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Choice {
    /// Kind of model.
    pub kind: String,
    /// Effects added to the first model.
    pub added: Vec<String>,
    /// True if it predicts postures left out better than the first model, beyond chance.
    pub convinces: bool,
    /// Gains over the first model; of a field of joint errors, over the model that it is added to.
    pub gains: Vec<Gain>,
    /// The field of joint errors; only with one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<Field>,
}

/// A field of joint errors at the poses where the robot is to work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Field {
    /// True if it is to be used there.
    pub used: bool,
    /// What it consists of, or why it is not used.
    pub why: String,
    /// Mean error to expect without it, noise included, mm.
    pub before_mm: f64,
    /// Mean error to expect with it, noise included, mm.
    pub after_mm: f64,
}

/// The recommended model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Recommended {
    /// Kind of model.
    pub kind: String,
    /// Its effects.
    pub model: Vec<String>,
    /// The reason.
    pub why: String,
    /// Error of postures left out, rms, mm; null if unknown.
    pub held_out_mm: Option<f64>,
    /// Unit of cross-validation: `postures`.
    pub held_out_by: String,
    /// True if a better model was withdrawn because other data contradict it.
    pub withdrawn: bool,
}

/// A step that was tried and refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct TriedStep {
    /// Id of the effect.
    pub effect: String,
    /// Objections to the step, in words.
    pub objections: Vec<String>,
}

/// Reason why the ladder ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Stopped {
    /// Name of the reason.
    pub because: String,
    /// Outcome of a fit that did not converge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outcome: Option<String>,
    /// Steps that were tried and refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tried: Option<Vec<TriedStep>>,
}

/// The models from the first to the last, and the recommended one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ladder {
    /// Format tag.
    pub format: LadderFormat,
    /// The steps.
    #[serde(rename = "rungs")]
    pub steps: Vec<LadderStep>,
    /// Reason why the ladder ended.
    pub stopped: Stopped,
    /// The recommended model, if it is none of the steps.
    pub other: Option<LadderStep>,
    /// The compared models.
    pub choices: Vec<Choice>,
    /// Excluded samples.
    pub set_aside: Vec<String>,
    /// The recommended model.
    pub recommended: Recommended,
    /// The recommendation in words.
    pub advice: String,
    /// Rows outside the joint ranges of the recommended calibration; null if there are none.
    pub outside_range: Option<OutsideRange>,
    /// Warning that the data do not fit the robot, if used nevertheless.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<String>,
    /// Agreement of the robot with its fleet, if one was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fleet: Option<FleetUsed>,
}

impl Choice {
    fn of(choice: &selection::recommend::Choice) -> Self {
        let field = |field: &selection::recommend::FieldChoice| Field {
            used: field.gate.is_open(),
            why: unused_sentence(&field.gate).unwrap_or_else(|| shares_sentence(&choice.model.registry, field)),
            before_mm: field.expected[0] / MM,
            after_mm: field.expected[1] / MM,
        };
        Choice {
            field: choice.field.as_ref().map(field),
            kind: choice.kind.name().into(),
            added: ids(&choice.added),
            convinces: choice.convinces(),
            gains: choice.gains.iter().map(Gain::of).collect(),
        }
    }
}

impl Recommended {
    /// The model that a ladder recommends, and the reason.
    #[must_use]
    pub fn of(ladder: &selection::ladder::Ladder) -> Self {
        let choices = &ladder.recommendation.choices;
        let judged = if ladder.withdrawn.is_some() { &choices[0] } else { ladder.recommendation.choice() };
        Recommended {
            kind: ladder.kind().name().into(),
            model: ladder.recommended().model.ids(),
            why: why(ladder),
            held_out_mm: judged.cross_validated().map(|m| m / MM),
            held_out_by: "postures".into(),
            withdrawn: ladder.withdrawn.is_some(),
        }
    }
}

impl Stopped {
    fn of(top: &StopReason) -> Self {
        let outcome = match top {
            StopReason::NotConverged(outcome) => Some(outcome.name().into()),
            _ => None,
        };
        let one = |step: &RefusedStep| TriedStep {
            effect: joined(&step.effects),
            objections: step.objections.iter().map(objection_sentence).collect(),
        };
        let tried = match top {
            StopReason::NoStepHelps { tried } => Some(tried.iter().map(one).collect()),
            _ => None,
        };
        Stopped { because: top.name().into(), outcome, tried }
    }
}

impl Ladder {
    /// The document of a ladder.
    #[must_use]
    pub fn of(ladder: &selection::ladder::Ladder) -> Self {
        let all: Vec<&selection::ladder::LadderStep> = ladder.steps.iter().collect();
        Ladder {
            format: LadderFormat::Current,
            steps: LadderStep::all(&all),
            stopped: Stopped::of(&ladder.top),
            other: ladder.other.as_ref().map(|other| LadderStep::of(other, &all)),
            choices: ladder.recommendation.choices.iter().map(Choice::of).collect(),
            set_aside: ladder.recommendation.aside.clone(),
            recommended: Recommended::of(ladder),
            advice: advice(ladder),
            outside_range: None,
            misfit: None,
            fleet: None,
        }
    }
}
