//! `calibench-next/1`, printed by `plan next`, and `calibench-detectability/1`, printed by `plan`.

use calibench::diagnosis;
use calibench::planning;
use calibench::planning::designer::Criterion;
use calibench::planning::{Kind, Offer, Proposal};
use calibench::units::MM;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Recommended, Untestable, finite, format_tag};
use crate::next::next_sentences;
use crate::printout::texts;

format_tag!(NextFormat, "calibench-next/1");
format_tag!(DetectabilityFormat, "calibench-detectability/1");

/// One minute, s.
const MINUTE: f64 = 60.0;

/// An effect in question.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rival {
    /// Id of the effect.
    pub effect: String,
    /// Its probability now.
    pub probability: f64,
}

/// The outcome expected after a number of measurements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlannedStep {
    /// Number of measurements.
    pub measurements: usize,
    /// Their duration, minutes; null where nothing is measured.
    pub minutes: Option<f64>,
    /// Expected probability of the true effect; null if none is in question.
    pub probability_of_truth: Option<f64>,
    /// Chance that the effects in question are distinguished; null if none is in question.
    pub resolved: Option<f64>,
    /// Expected position error over the workspace, mm; null if it cannot be predicted.
    pub workspace_error_mm: Option<f64>,
    /// The action in words, where it is not evident from the place of the step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub action: Option<String>,
}

/// A possible action.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Action {
    /// The action in words.
    pub action: String,
    /// `balls`, `other_side`, `later`, `moved_artifact` or `points`.
    pub kind: String,
    /// Set-up time, minutes.
    pub setup_min: f64,
    /// Time for one measurement, minutes.
    pub each_min: f64,
    /// Number of candidate measurements.
    pub candidates: usize,
    /// Expected outcomes.
    pub steps: Vec<PlannedStep>,
}

/// An action that is not possible here.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct NotOffered {
    /// The action in words.
    pub action: String,
    /// The reason.
    pub because: String,
}

/// The next measurements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Next {
    /// Format tag.
    pub format: NextFormat,
    /// `discrimination`, `accuracy`, `determination` or `random`.
    pub criterion: String,
    /// Effects in question.
    pub rivals: Vec<Rival>,
    /// The state without further measurements.
    pub now: PlannedStep,
    /// Possible actions.
    pub actions: Vec<Action>,
    /// The best of them; null if none helps.
    pub best: Option<PlannedStep>,
    /// Actions that are not possible.
    pub not_offered: Vec<NotOffered>,
    /// The proposal in words.
    pub sentences: Vec<String>,
    /// True if the layout of the cell is known from a scenario or cell file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cell_known: Option<bool>,
    /// Files written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub written: Option<Vec<String>>,
    /// The model for which the measurements are planned, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub planned_for: Option<String>,
    /// The model recommended now.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recommended: Option<Recommended>,
    /// Warning that the data do not fit the robot, if used nevertheless.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<String>,
}

/// Detectability of an effect by a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectDetectability {
    /// Id of the effect.
    pub effect: String,
    /// Share of the effect that the model absorbs.
    pub absorbed: f64,
    /// The rest of one plausible size, rms, in units of the noise.
    pub visible_rms: f64,
    /// Number of directions that are not absorbed.
    pub directions: usize,
    /// Smallest detectable size, in plausible sizes; null if undetectable.
    pub smallest_plausible: Option<f64>,
    /// The same in `unit`.
    pub smallest: Option<f64>,
    /// Plausible size, in `unit`.
    pub plausible: f64,
    /// Symbol of the unit.
    pub unit: String,
}

/// Detectability of every effect by a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Detectability {
    /// Format tag.
    pub format: DetectabilityFormat,
    /// Significance level of the test.
    pub level: f64,
    /// Power of the test.
    pub power: f64,
    /// The effects, the most detectable first.
    pub effects: Vec<EffectDetectability>,
    /// Effects that the plan cannot test.
    pub untestable: Vec<Untestable>,
}

fn kind_name(kind: &Kind) -> &'static str {
    match kind {
        Kind::Balls { .. } => "balls",
        Kind::OtherSide => "other_side",
        Kind::Later => "later",
        Kind::MovedArtifact { .. } => "moved_artifact",
        Kind::Points => "points",
    }
}

fn criterion_name(criterion: Criterion) -> &'static str {
    match criterion {
        Criterion::Discrimination => "discrimination",
        Criterion::Accuracy => "accuracy",
        Criterion::Determination => "determination",
        Criterion::Random(_) => "random",
    }
}

impl PlannedStep {
    fn of(step: &planning::Step, offer: Option<&Offer>) -> Self {
        PlannedStep {
            measurements: step.count,
            minutes: offer.map(|o| o.action.duration(step.count) / MINUTE),
            probability_of_truth: step.forecast.map(|o| o.truth),
            resolved: step.forecast.map(|o| o.resolved),
            workspace_error_mm: step.error.and_then(|e| finite(e / MM)),
            action: None,
        }
    }
}

impl Action {
    fn of(offer: &Offer) -> Self {
        Action {
            action: offer.action.words(),
            kind: kind_name(&offer.action.kind).into(),
            setup_min: offer.action.setup_s / MINUTE,
            each_min: offer.action.each_s / MINUTE,
            candidates: offer.action.pool.len(),
            steps: offer.steps.iter().map(|s| PlannedStep::of(s, Some(offer))).collect(),
        }
    }
}

impl Next {
    /// The document of a proposal.
    #[must_use]
    pub fn of(p: &Proposal) -> Self {
        let best = p.best(|_| true);
        let best =
            best.map(|(offer, step)| PlannedStep { action: Some(offer.action.words()), ..PlannedStep::of(step, Some(offer)) });
        let not_offered = |n: &planning::NotOffered| NotOffered { action: n.what.clone(), because: n.because.clone() };
        Next {
            format: NextFormat::Current,
            criterion: criterion_name(p.criterion).into(),
            rivals: p.rivals.iter().map(|r| Rival { effect: r.effect.to_string(), probability: r.probability }).collect(),
            now: PlannedStep::of(&p.now, None),
            actions: p.offers.iter().map(Action::of).collect(),
            best,
            not_offered: p.not_offered.iter().map(not_offered).collect(),
            sentences: texts(next_sentences(p)),
            cell_known: None,
            written: None,
            planned_for: None,
            recommended: None,
            misfit: None,
        }
    }
}

impl Detectability {
    /// The document of the detectability by a plan.
    #[must_use]
    pub fn of(d: &diagnosis::detectability::Detectability) -> Self {
        let effect = |s: &diagnosis::detectability::Sight| EffectDetectability {
            effect: s.effect.to_string(),
            absorbed: s.absorbed,
            visible_rms: s.visible,
            directions: s.directions,
            smallest_plausible: s.smallest,
            smallest: s.smallest_size().map(|v| s.unit.from_si(v)),
            plausible: s.unit.from_si(s.plausible),
            unit: s.unit.symbol.into(),
        };
        Detectability {
            format: DetectabilityFormat::Current,
            level: d.level,
            power: d.power,
            effects: d.sights.iter().map(effect).collect(),
            untestable: Untestable::all(&d.untestable),
        }
    }
}
