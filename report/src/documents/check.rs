//! `calibench-check/1`, printed by `keep check`.

use calibench::monitoring;
use calibench::monitoring::check::charts::{Charts, RUN_LENGTH};
use calibench::monitoring::check::conditions::Condition;
use calibench::monitoring::check::power::{ChangeSize, SmallestDetectable};
use calibench::monitoring::check::{FALSE_ALARM, NoiseOf, RobotCheck};
use calibench::units::{MM, UM};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Intervention, format_tag};
use crate::charts::{elementary_name, elementary_unit, elementary_words};
use crate::check::{condition_words, noise_remark, quantity_unit, sizes, too_alike_remark, what_to_do};

format_tag!(CheckFormat, "calibench-check/1");

/// The result of a check of a calibrated robot, or of its plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Check {
    /// `calibench-check/1`.
    pub format: CheckFormat,
    /// `valid` or `changed`; null for a plan.
    pub verdict: Option<String>,
    /// Probability that a check ever reports a change where there is none.
    pub false_alarm: f64,
    /// Conditions with their probabilities, the most probable first.
    pub conditions: Vec<CheckedCondition>,
    /// Conditions that these poses cannot distinguish from the most probable change.
    pub aliased: Vec<String>,
    /// If something has changed: the single change that comes closest, and what it leaves.
    pub closest: Option<ClosestChange>,
    /// If something has changed: the size of what is named, if it has one.
    #[serde(default)]
    pub size: Option<SizeOfChange>,
    /// Source of the noise: `stated`, or `repeats` of the campaign; null for a plan.
    pub noise_from: Option<String>,
    /// Number of samples given.
    pub samples: usize,
    /// The samples used, in order.
    pub looks: Vec<Look>,
    /// For a plan: ids of the samples to measure again, in order.
    pub sentinels: Vec<String>,
    /// For a plan: what the check would find. For a check: the smallest change of each condition that its samples show with a
    /// probability of 0.95, in the direction in which they show it least, when all of them are used.
    pub power: Vec<ConditionPower>,
    /// Remarks on the samples that qualify the verdict.
    #[serde(default)]
    pub remarks: Vec<String>,
    /// With a history: the control charts of all its checks.
    pub charts: Option<ControlCharts>,
}

/// Control charts over the checks of a robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ControlCharts {
    /// Mean number of checks until any chart signals while nothing changes.
    pub run_length: f64,
    /// Limit of every moving average, in its standard deviations.
    pub limit: f64,
    /// Days of the checks.
    pub days: Vec<String>,
    /// The charts.
    pub charts: Vec<ControlChart>,
}

/// The course of one elementary change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ControlChart {
    /// `joint:J`, `tool:x`, `base:x` or `growth`.
    pub of: String,
    /// The same in words.
    pub words: String,
    /// Unit of changes: `mdeg`, `um` or `ppm`.
    pub unit: String,
    /// Change since the mean of all measurements before, by check; null if these poses do not show it.
    pub change: Vec<Option<f64>>,
    /// Its one-sigma.
    pub sigma: Vec<Option<f64>>,
    /// The moving average, in its standard deviations.
    pub average: Vec<f64>,
    /// Day of the check that signalled; null if none did.
    pub signal: Option<String>,
}

/// A condition that a robot may be in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CheckedCondition {
    /// `valid`, `tool_moved`, `base_or_artifact_moved`, `ball_moved:B`, `target_moved:T`, `joint_slipped:J`, `warm`,
    /// `payload_not_as_entered`, `sample:ID` or `recalibrate`.
    pub condition: String,
    /// The same in words.
    pub words: String,
    /// Remedy.
    #[serde(rename = "do")]
    pub to_do: String,
    /// Its probability.
    pub probability: f64,
    /// The work, and how it is verified; null if nothing has changed, or nobody knows what.
    #[serde(default)]
    pub intervention: Option<Intervention>,
}

/// Size of the change that is named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SizeOfChange {
    /// `deg`, `um`, `ppm`, `kg` or `mdeg/N.m`.
    pub unit: String,
    /// One number; or three along x, y and z, of the flange for a tool or a target, of the world for a base or a ball.
    pub components: Vec<ChangedBy>,
}

/// A number of a change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChangedBy {
    /// The number.
    pub change: f64,
    /// Its 95 % interval, as a half width.
    pub within_95: f64,
}

/// The single change that comes closest to the differences.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClosestChange {
    /// The condition.
    pub condition: String,
    /// The same in words.
    pub words: String,
    /// Residual of the differences after this condition, rms per axis, um.
    pub left_um: f64,
    /// Noise of a comparison, rms per axis, um.
    pub noise_um: f64,
    /// True if it explains the differences; false if that is not all that has changed.
    pub explains: bool,
}

/// The state of a check after one sample.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Look {
    /// Id of the sample.
    pub sample: String,
    /// Id of the sample of the same pose when the robot was calibrated.
    pub counterpart: String,
    /// Change of the position error since, mm.
    pub change_mm: f64,
    /// Noise of that change, one-sigma per axis, um.
    pub noise_um: f64,
    /// Average likelihood ratio of all changes to none; a change is reported at one over `false_alarm`.
    pub ratio: f64,
}

/// Power of a check to find one condition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ConditionPower {
    /// The condition.
    pub condition: String,
    /// By size; empty if the samples of a check do not show it.
    pub at: Vec<PowerAtSize>,
    /// For a check: the smallest change that is shown; null if the samples do not show it.
    pub change: Option<f64>,
    /// Unit of that change: `deg`, `um`, `ppm` or `kg`; null for a plan.
    pub unit: Option<String>,
}

/// Power of a check to find a condition of one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PowerAtSize {
    /// Root mean square displacement of the samples, in units of the noise of one comparison.
    pub size: f64,
    /// Share of checks that report a change.
    pub found: f64,
    /// Share of checks that name the condition, or one that their poses cannot distinguish from it.
    pub named: f64,
    /// Mean number of samples until it is named.
    pub samples: f64,
}

impl PowerAtSize {
    fn of(p: &monitoring::check::power::PowerAt) -> Self {
        PowerAtSize { size: p.size, found: p.found, named: p.named, samples: p.samples }
    }
}

impl Check {
    /// Converts a check, with the smallest changes that its samples show.
    #[must_use]
    pub fn of(check: &RobotCheck, shown: &[SmallestDetectable]) -> Self {
        let condition = |j: &monitoring::check::Judged| CheckedCondition {
            condition: j.condition.name(),
            words: condition_words(&j.condition),
            to_do: what_to_do(&j.condition).into(),
            probability: j.probability,
            intervention: j.condition.intervention().map(Intervention::from),
        };
        let size = |size: &ChangeSize| {
            let (_, name, _) = quantity_unit(size.quantity);
            let changed = |[change, within_95]: [f64; 2]| ChangedBy { change, within_95 };
            SizeOfChange { unit: name.into(), components: sizes(size).into_iter().map(changed).collect() }
        };
        let look = |l: &monitoring::check::ViewResult| Look {
            sample: l.sample.clone(),
            counterpart: l.counterpart.clone(),
            change_mm: l.change / MM,
            noise_um: l.noise / UM,
            ratio: l.ratio,
        };
        let closest = |c: &monitoring::check::Closest| ClosestChange {
            condition: c.condition.name(),
            words: condition_words(&c.condition),
            left_um: c.left / UM,
            noise_um: c.noise / UM,
            explains: c.explains,
        };
        let power = |s: &SmallestDetectable| {
            let (unit, name, _) = quantity_unit(s.quantity);
            ConditionPower {
                condition: s.condition.name(),
                at: s.smallest.iter().map(|smallest| PowerAtSize::of(&smallest.at)).collect(),
                change: s.smallest.as_ref().map(|smallest| smallest.change / unit),
                unit: Some(name.into()),
            }
        };
        Check {
            format: CheckFormat::Current,
            verdict: Some(if check.changed { "changed" } else { "valid" }.into()),
            false_alarm: FALSE_ALARM,
            conditions: check.conditions.iter().map(condition).collect(),
            aliased: check.aliased.iter().map(Condition::name).collect(),
            closest: check.closest.as_ref().map(closest),
            size: check.size.as_ref().map(size),
            noise_from: Some(if check.noise == NoiseOf::Stated { "stated" } else { "repeats" }.into()),
            samples: check.given,
            looks: check.looks.iter().map(look).collect(),
            sentinels: Vec::new(),
            power: shown.iter().map(power).collect(),
            remarks: too_alike_remark(check).into_iter().chain(noise_remark(check)).collect(),
            charts: None,
        }
    }

    /// Converts the plan of a check: ids of the samples to measure again, and what that would show.
    #[must_use]
    pub fn of_plan(sentinels: Vec<String>, power: &[monitoring::check::power::Power]) -> Self {
        let of = |p: &monitoring::check::power::Power| ConditionPower {
            condition: p.condition.name(),
            at: p.at.iter().map(PowerAtSize::of).collect(),
            change: None,
            unit: None,
        };
        Check {
            format: CheckFormat::Current,
            verdict: None,
            false_alarm: FALSE_ALARM,
            conditions: Vec::new(),
            aliased: Vec::new(),
            closest: None,
            size: None,
            noise_from: None,
            samples: sentinels.len(),
            looks: Vec::new(),
            sentinels,
            power: power.iter().map(of).collect(),
            remarks: Vec::new(),
            charts: None,
        }
    }

    /// The same with the charts of checks on these days.
    #[must_use]
    pub fn with_charts(self, days: &[String], charts: &Charts) -> Self {
        let chart = |chart: &monitoring::check::charts::Chart| {
            let (unit, name, _) = elementary_unit(chart.of);
            let seen = |p: &monitoring::check::charts::ChartPoint, x: f64| p.sigma.is_finite().then_some(x / unit);
            ControlChart {
                of: elementary_name(chart.of),
                words: elementary_words(chart.of),
                unit: name.into(),
                change: chart.points.iter().map(|p| seen(p, p.estimate)).collect(),
                sigma: chart.points.iter().map(|p| seen(p, p.sigma)).collect(),
                average: chart.points.iter().map(|p| p.average).collect(),
                signal: chart.signal(charts.limit).and_then(|k| days.get(k).cloned()),
            }
        };
        let charts = ControlCharts {
            run_length: RUN_LENGTH,
            limit: charts.limit,
            days: days.to_vec(),
            charts: charts.charts.iter().map(chart).collect(),
        };
        Check { charts: Some(charts), ..self }
    }
}
