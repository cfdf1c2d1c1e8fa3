//! `calibench-runs/1`, printed by `keep runs`.

use calibench::identify::calibration::Estimate;
use calibench::monitoring;
use calibench::monitoring::runs::tables::EffectStatus;
use calibench::monitoring::runs::{RUNS_FALSE_ALARM, RunsComparison};
use calibench::units::{MM, UM};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::format_tag;
use crate::runs::difference_sentence;

format_tag!(RunsFormat, "calibench-runs/1");

/// Many runs of one robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Runs {
    /// `calibench-runs/1`.
    pub format: RunsFormat,
    /// `one_geometry`, `one_geometry_with_changes` or `not_one_geometry`.
    pub verdict: String,
    /// Probability that runs of a robot in which nothing changed are reported to differ.
    pub false_alarm: f64,
    /// Errors of the robot of all other runs, all runs together.
    pub left_out: LeftOutErrors,
    /// The runs, in the order of time.
    pub runs: Vec<RunOfRuns>,
    /// All parameters of the arm free in every run, before any difference is named.
    pub before: TestOfRuns,
    /// The differences, in the order in which they were found.
    pub differences: Vec<DifferenceOfRuns>,
    /// The same test with these differences.
    pub after: TestOfRuns,
    /// Every parameter of the arm.
    pub parameters: Vec<ParameterOfRuns>,
    /// Every effect of the model beside geometry and compliance.
    pub effects: Vec<EffectOfRuns>,
    /// Ids of the effects of the model that predicts runs left out best.
    pub model: Vec<String>,
    /// By how much the mean temperatures of the runs differ, K, if an arm shows as much and no effect of the model depends on it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warmer_k: Option<f64>,
}

/// Root mean square errors of the robot of the other runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LeftOutErrors {
    /// Of the model given, mm; null if no run could be judged.
    pub model_mm: Option<f64>,
    /// With error curves of all joints, mm.
    pub curves_mm: Option<f64>,
}

/// A run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RunOfRuns {
    /// Name.
    pub run: String,
    /// Date, `YYYY-MM-DD`; null if not stated.
    pub date: Option<String>,
    /// Number of samples that were fitted.
    pub samples: usize,
    /// Number of their postures.
    pub postures: usize,
    /// Residual under the robot that the runs share, rms in 3-D, mm.
    pub residual_mm: f64,
    /// Noise per axis that remains when error curves are allowed for, um.
    pub noise_um: f64,
    /// Errors of the robot of the other runs with the model given; null if they cannot be judged.
    pub from_others: Option<ErrorsLeftOut>,
    /// The same with error curves of all joints.
    pub from_others_with_curves: Option<ErrorsLeftOut>,
    /// The reason why it cannot be judged.
    pub not_judged: Option<String>,
}

/// Errors at a run that was not fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ErrorsLeftOut {
    /// Root mean square, mm.
    pub rms_mm: f64,
    /// Mean, mm.
    pub mean_mm: f64,
    /// Largest, mm.
    pub max_mm: f64,
    /// Number of samples.
    pub samples: usize,
}

/// A test of differences between runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TestOfRuns {
    /// Ratio of the mean squares.
    pub f: f64,
    /// Its degrees of freedom.
    pub above: f64,
    /// Those of the residuals.
    pub below: f64,
    /// Probability of a larger ratio if nothing differs.
    pub chance: f64,
}

/// A difference between runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DifferenceOfRuns {
    /// Id of the effect.
    pub effect: String,
    /// `since RUN`, `in RUN` or `per month`.
    pub when: String,
    /// The same in words.
    pub words: String,
    /// True if tool, base or balls of a run differ, which are not part of the robot.
    pub of_set_up: bool,
    /// True if the model lacks the effect.
    pub missing: bool,
    /// Its parameters.
    pub parameters: Vec<ChangedParameter>,
    /// Its test.
    pub test: TestOfRuns,
    /// Number of differences that were tried.
    pub tried: usize,
    /// Other differences that these runs cannot tell from it.
    pub aliased: Vec<String>,
}

/// A number with its uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChangedParameter {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// One sigma.
    pub sigma: f64,
    /// Unit of both.
    pub unit: String,
}

/// A parameter of the arm in all runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterOfRuns {
    /// Name.
    pub name: String,
    /// Unit of all numbers.
    pub unit: String,
    /// Nominal value.
    pub nominal: f64,
    /// Value in the first run.
    pub first: f64,
    /// Value in the last run.
    pub last: f64,
    /// One sigma of the value.
    pub sigma: f64,
    /// `stayed`, `moved` or `unseen`.
    pub status: String,
    /// Change in every run since the first, with one sigma: as the differences named have it, if it moved, and else as if it alone
    /// were free beside them; null where a run does not show it.
    pub changes: Vec<Option<[f64; 2]>>,
    /// Its drift; null without dates, or if the runs do not show it.
    pub drift: Option<DriftOfParameter>,
}

/// A drift as a random walk.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DriftOfParameter {
    /// One sigma of the change in a month: the most likely one.
    pub monthly: f64,
    /// It is smaller than this at a level of 95 %; null if the runs set no limit.
    pub at_most: Option<f64>,
}

/// An effect of the model in all runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectOfRuns {
    /// Id.
    pub effect: String,
    /// `stayed`, `moved`, `one_run_only`, `rests_on_one_run` or `not_there`.
    pub status: String,
    /// The run to which it belongs; null unless it is one.
    pub run: Option<String>,
    /// Its parameters, all runs together.
    pub parameters: Vec<ChangedParameter>,
    /// Its size in every run, in sigmas.
    pub sigmas: Vec<f64>,
    /// Share of every run in what all runs say of it.
    pub shares: Vec<f64>,
}

impl Runs {
    /// Converts a comparison; `dates` are those of the runs.
    #[must_use]
    pub fn of(comparison: &RunsComparison, dates: &[Option<String>]) -> Self {
        let names: Vec<&str> = comparison.runs.iter().map(|run| run.name.as_str()).collect();
        let [model_mm, curves_mm] = comparison.left_out.map(|error| error.map(|e| e / MM));
        let run = |(run, date): (&monitoring::runs::tables::RunOfRobot, &Option<String>)| {
            let judged = |k: usize| {
                let result = run.from_others.as_ref().map(|both| &both[k]);
                result.and_then(|r| r.as_ref().ok()).map(ErrorsLeftOut::of)
            };
            let why = run.from_others.iter().flatten().find_map(|result| result.as_ref().err().cloned());
            RunOfRuns {
                run: run.name.clone(),
                date: date.clone(),
                samples: run.samples,
                postures: run.postures,
                residual_mm: run.residual / MM,
                noise_um: run.noise / UM,
                from_others: judged(0),
                from_others_with_curves: judged(1),
                not_judged: why,
            }
        };
        let difference = |d: &monitoring::runs::Difference| DifferenceOfRuns {
            effect: d.effect.to_string(),
            when: d.pattern.words(&names),
            words: difference_sentence(&comparison.model.registry, d, &names),
            of_set_up: d.set_up_of.is_some(),
            missing: d.missing,
            parameters: d.parameters.iter().map(ChangedParameter::of).collect(),
            test: TestOfRuns::of(&d.test),
            tried: d.tried,
            aliased: d.aliased.clone(),
        };
        let effect = |e: &monitoring::runs::tables::EffectInRuns| EffectOfRuns {
            effect: e.effect.to_string(),
            status: e.status.name().into(),
            run: match e.status {
                EffectStatus::OnlyIn(run) | EffectStatus::RestsOn(run) => names.get(run).map(|n| (*n).to_owned()),
                _ => None,
            },
            parameters: e.parameters.iter().map(ChangedParameter::of).collect(),
            sigmas: e.in_runs.iter().map(|[sigmas, _]| *sigmas).collect(),
            shares: e.in_runs.iter().map(|[_, share]| *share).collect(),
        };
        Runs {
            format: RunsFormat::Current,
            verdict: comparison.verdict.name().into(),
            warmer_k: comparison.warmer,
            false_alarm: RUNS_FALSE_ALARM,
            left_out: LeftOutErrors { model_mm, curves_mm },
            runs: comparison.runs.iter().zip(dates).map(run).collect(),
            before: TestOfRuns::of(&comparison.before),
            differences: comparison.differences.iter().map(difference).collect(),
            after: TestOfRuns::of(&comparison.after),
            parameters: comparison.parameters.iter().map(ParameterOfRuns::of).collect(),
            effects: comparison.effects.iter().map(effect).collect(),
            model: comparison.model.ids(),
        }
    }
}

impl ErrorsLeftOut {
    fn of(errors: &monitoring::runs::LeftOut) -> Self {
        ErrorsLeftOut { rms_mm: errors.rms / MM, mean_mm: errors.mean / MM, max_mm: errors.max / MM, samples: errors.samples }
    }
}

impl TestOfRuns {
    fn of(test: &monitoring::runs::RunsTest) -> Self {
        TestOfRuns { f: test.f, above: test.above, below: test.below, chance: test.chance }
    }
}

impl ChangedParameter {
    fn of(e: &Estimate) -> Self {
        let unit = e.unit.si;
        ChangedParameter { name: e.name.clone(), value: e.value / unit, sigma: e.sigma / unit, unit: e.unit.symbol.into() }
    }
}

impl ParameterOfRuns {
    fn of(p: &monitoring::runs::tables::ParameterInRuns) -> Self {
        let unit = p.first.unit.si;
        let drift = |d: &monitoring::runs::Drift| DriftOfParameter {
            monthly: d.monthly / unit,
            at_most: d.at_most.is_finite().then_some(d.at_most / unit),
        };
        ParameterOfRuns {
            name: p.first.name.clone(),
            unit: p.first.unit.symbol.into(),
            nominal: p.first.nominal / unit,
            first: p.first.value / unit,
            last: p.last / unit,
            sigma: p.first.sigma / unit,
            status: p.status.name().into(),
            changes: p.changes.iter().map(|c| c.map(|[value, sigma]| [value / unit, sigma / unit])).collect(),
            drift: p.drift.as_ref().map(drift),
        }
    }
}
