//! `calibench-diagnosis/2`, printed by `diagnose`.

use calibench::diagnosis;
use calibench::diagnosis::Verdict;
use calibench::effects::EffectId;
use calibench::effects::registry::Registry;
use calibench::selection;
use calibench::selection::ladder::RefusedStep;
use calibench::units::MM;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::step::Moment;
use super::{FleetUsed, HeatMap, Intervention, OutsideRange, Scatter, Untestable, Workspace, finite, format_tag, ids, joined};
use crate::diagnosis_sentences::sentences;
use crate::finding_notes::parted_by;
use crate::ladder_sentences::objection_sentence;
use crate::next_step::{command, next_step_sentences};
use crate::printout::texts;
use crate::recommended::Recommended;
use crate::workspace::Forecast;

format_tag!(DiagnosisFormat, "calibench-diagnosis/2");

/// Part of the data in which an effect occurs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FindingPlace {
    /// Number of periods.
    Order(u32),
    /// Time since the session began, s.
    TimeS(f64),
    /// Id of a sample.
    Sample(String),
}

/// A parameter of a finding, as estimated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FoundParameter {
    /// Name.
    pub name: String,
    /// Estimate, in `unit`.
    pub value: f64,
    /// One-sigma, in `unit`; null if undetermined.
    pub sigma: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
}

/// An effect that is significant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Finding {
    /// Rank, from 1.
    pub rank: usize,
    /// Id of the hypothesis.
    pub effect: String,
    /// The id by which a model accepts it.
    pub in_model: String,
    /// Order, time or sample, where the effect has one.
    pub at: Option<FindingPlace>,
    /// Posterior probability.
    pub probability: f64,
    /// Share of the residual's variance explained.
    pub explains: f64,
    /// p-value after correction for all hypotheses tested.
    pub p_family: f64,
    /// Difference of the Bayesian information criterion.
    pub delta_bic: f64,
    /// Gain of the cross-validated error, as a share.
    pub cv_gain: f64,
    /// Part of the effect that the fitted model does not absorb, as a share.
    pub visible: f64,
    /// Natural logarithm of the evidence against noise.
    pub ln_evidence: f64,
    /// Natural logarithm of the evidence against the model discrepancy.
    pub ln_evidence_against_background: f64,
    /// Estimated size, in plausible sizes.
    pub size_plausible: f64,
    /// Effects that these data do not distinguish from it.
    pub rivals: Vec<String>,
    /// Estimates of its parameters.
    pub parameters: Vec<FoundParameter>,
    /// Effects with exactly the same columns in these data.
    pub exactly_same: Vec<String>,
    /// The measurement that would separate it from these.
    pub parted_by: Option<String>,
    /// Time of a step; null for other effects.
    pub moment: Option<Moment>,
    /// What to do about it at the robot; null for a user-defined effect.
    #[serde(default)]
    pub intervention: Option<Intervention>,
}

/// The share of the residual that an effect explains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Explained {
    /// Id of the effect.
    pub effect: String,
    /// Share of the variance, percent.
    pub explains_percent: f64,
}

/// An effect too large to be believed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unbelievable {
    /// Id of the effect.
    pub effect: String,
    /// Estimated size, in plausible sizes.
    pub size_plausible: f64,
}

/// Effects that together form a curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurveFamily {
    /// Id of the family.
    pub effect: String,
    /// Share of the variance explained.
    pub share: f64,
}

/// Contribution of an effect when everything is fitted at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Contribution {
    /// Id of the effect.
    pub effect: String,
    /// Share of the residual.
    pub share: f64,
    /// Size, in plausible sizes.
    pub size_plausible: f64,
}

/// Diagnosis of a model: its misfit and the effects that explain it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Diagnosis {
    /// Format tag.
    pub format: DiagnosisFormat,
    /// True if the masses of the links are guessed from the reach of the arm.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub masses_guessed: bool,
    /// Number of fitted rows.
    pub samples: usize,
    /// Degrees of freedom.
    pub dof: usize,
    /// Residual, rms, mm.
    pub residual_mm: f64,
    /// The part of the noise that remains in the residual, mm.
    pub noise_left_mm: f64,
    /// Residual beyond the noise, mm.
    pub unexplained_mm: f64,
    /// Sum of squared residuals over the noise, per degree of freedom; null if the noise is unknown.
    pub chi2_per_dof: Option<f64>,
    /// p-value of the lack of fit; null if the noise is unknown.
    pub lack_of_fit_p: Option<f64>,
    /// One of the verdicts of the glossary, in snake case.
    pub verdict: String,
    /// Outcome of the fit.
    pub outcome: String,
    /// The verdict without the suspect samples; null if there are none.
    pub verdict_without_suspects: Option<String>,
    /// Share of the variance explained by the first finding, percent.
    pub explains_percent: Option<f64>,
    /// chi2/dof with the first finding in the model.
    pub chi2_per_dof_with_it: Option<f64>,
    /// Effects that together explain the residual.
    pub together: Vec<Explained>,
    /// Share of the variance that these explain, percent.
    pub together_explain_percent: f64,
    /// Effects that fit, but not at a believable size.
    pub not_believable: Vec<Unbelievable>,
    /// The family of curves to which several findings belong.
    pub curve_family: Option<CurveFamily>,
    /// The 95 % credible set of effects.
    pub set95: Vec<String>,
    /// Probability that no effect of the catalogue is missing.
    pub nothing_probability: f64,
    /// Size of the model discrepancy, in plausible sizes.
    pub background_plausible: f64,
    /// Effects that are significant, best first.
    pub findings: Vec<Finding>,
    /// Contributions when everything is fitted at once.
    pub contributions: Vec<Contribution>,
    /// Evidence by joint and variable.
    pub heat_map: HeatMap,
    /// Effects that these data cannot test.
    pub untestable: Vec<Untestable>,
    /// Effects of the fitted model.
    pub fitted: Vec<String>,
    /// Error expected over the workspace; null if it cannot be predicted.
    pub workspace: Option<Workspace>,
    /// Poses of that prediction outside the identified joint ranges.
    pub outside_range: Option<OutsideRange>,
    /// The diagnosis in words.
    pub sentences: Vec<String>,
    /// Recommended next step; absent where the steps of the ladder were not requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub advice: Option<Advised>,
    /// Scatter of the data.
    #[serde(flatten)]
    pub scatter: Scatter,
    /// Warning that the data do not fit the robot, if used nevertheless.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<String>,
    /// Agreement of the robot with its fleet, if one was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fleet: Option<FleetUsed>,
}

/// Recommended next step for a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Advised {
    /// `nothing`, `unknown`, `add`, `distinguish`, `choose` or `stop`.
    pub to_do: String,
    /// The effects of the step that the ladder takes first; with `distinguish`, that it would take; with `choose`, those that its
    /// recommended model adds.
    pub effects: Vec<String>,
    /// The command that does it; null if there is nothing to do.
    pub command: Option<String>,
    /// Effects that the ladder refused before that step.
    pub refused: Vec<RefusedEffect>,
    /// The advice in words.
    pub sentences: Vec<String>,
}

/// An effect that the ladder refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct RefusedEffect {
    /// Id of the effect.
    pub effect: String,
    /// The objections to it.
    pub objections: Vec<String>,
}

impl Advised {
    /// The document of an advice on the model of a diagnosis.
    #[must_use]
    pub fn of(advice: &selection::Advice, d: &diagnosis::Diagnosis, commands: &Recommended) -> Self {
        let refused = |step: &RefusedStep| RefusedEffect {
            effect: joined(&step.effects),
            objections: step.objections.iter().map(objection_sentence).collect(),
        };
        let is_done = matches!(advice.to_do, selection::ToDo::Nothing | selection::ToDo::Unknown);
        let command = (!is_done).then(|| command(advice, d, commands));
        Advised {
            to_do: advice.to_do.name().into(),
            effects: ids(advice.effects()),
            command,
            refused: advice.refused.iter().map(refused).collect(),
            sentences: next_step_sentences(advice, d, commands),
        }
    }
}

impl Finding {
    fn of(rank: usize, f: &diagnosis::Finding, registry: &Registry) -> Self {
        let h = &f.hypothesis;
        let parameter = |p: &diagnosis::FoundParameter| FoundParameter {
            name: p.name.clone(),
            value: p.unit.from_si(p.value),
            sigma: finite(p.unit.from_si(p.sigma)),
            unit: p.unit.symbol.into(),
        };
        let at = h.place.as_ref().map(|place| match place {
            diagnosis::hypotheses::Place::Order(k) => FindingPlace::Order(*k),
            diagnosis::hypotheses::Place::Time(t) => FindingPlace::TimeS(*t),
            diagnosis::hypotheses::Place::Sample(id) => FindingPlace::Sample(id.clone()),
        });
        Finding {
            rank,
            effect: h.effect.clone().into(),
            in_model: h.in_model.clone().into(),
            at,
            probability: f.probability,
            explains: h.explains,
            p_family: f.p_family,
            delta_bic: f.delta_bic,
            cv_gain: f.cv_gain,
            visible: h.visible,
            ln_evidence: h.ln_evidence,
            ln_evidence_against_background: h.ln_evidence_against_background,
            size_plausible: f.size,
            rivals: ids(&f.rivals),
            parameters: f.parameters.iter().map(parameter).collect(),
            exactly_same: ids(&f.exactly_same),
            parted_by: parted_by(f, registry),
            moment: h.moment.as_ref().map(Moment::of),
            intervention: registry.family(&h.in_model).map(|family| family.meaning.intervention.into()),
        }
    }
}

impl Diagnosis {
    /// The document of a diagnosis; `forecast` is the expected error over the workspace.
    #[must_use]
    pub fn of(d: &diagnosis::Diagnosis, forecast: Option<&Forecast>) -> Self {
        let explained =
            |e: &diagnosis::Explained| Explained { effect: e.effect.to_string(), explains_percent: 100.0 * e.share };
        let contribution =
            |c: &diagnosis::Contribution| Contribution { effect: c.effect.to_string(), share: c.share, size_plausible: c.size };
        let unbelievable =
            |(effect, size): &(EffectId, f64)| Unbelievable { effect: effect.to_string(), size_plausible: *size };
        Diagnosis {
            format: DiagnosisFormat::Current,
            masses_guessed: d.masses_guessed,
            samples: d.samples,
            dof: d.dof,
            residual_mm: d.rms / MM,
            noise_left_mm: d.noise / MM,
            unexplained_mm: d.unexplained / MM,
            chi2_per_dof: d.lack_of_fit_p.and_then(|_| finite(d.chi2_per_dof)),
            lack_of_fit_p: d.lack_of_fit_p,
            verdict: d.verdict.name().into(),
            outcome: d.outcome.name().into(),
            verdict_without_suspects: d.verdict_without_suspects.map(|v| Verdict::name(v).into()),
            explains_percent: d.explains.map(|share| 100.0 * share),
            chi2_per_dof_with_it: d.chi2_per_dof_with_it,
            together: d.together.iter().map(explained).collect(),
            together_explain_percent: 100.0 * d.together_explain,
            not_believable: d.unbelievable.iter().map(unbelievable).collect(),
            curve_family: d.curve_family.as_ref().map(|f| CurveFamily { effect: f.effect.to_string(), share: f.share }),
            set95: ids(&d.set95),
            nothing_probability: d.nothing,
            background_plausible: d.background,
            findings: d.findings.iter().enumerate().map(|(k, f)| Finding::of(k + 1, f, &d.registry)).collect(),
            contributions: d.contributions.iter().map(contribution).collect(),
            heat_map: HeatMap::of(&d.heat_map),
            untestable: Untestable::all(&d.untestable),
            fitted: d.fitted.clone(),
            workspace: forecast.map(Workspace::of_forecast),
            outside_range: forecast.and_then(|o| OutsideRange::of(&o.extrapolation)),
            sentences: texts(sentences(d)),
            advice: None,
            scatter: Scatter::of(&d.scatter),
            misfit: None,
            fleet: None,
        }
    }
}
