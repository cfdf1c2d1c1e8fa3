//! `calibench-judgement/1`, printed and written by `calibrate`.

use calibench::judgement::{ErrorRow, Judgement, Stage};
use calibench::units::{DEG, MM};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Workspace, format_tag};
use crate::diagnosis_sentences::cause_words;
use crate::first_screen::orientation_sentence;

format_tag!(JudgedFormat, "calibench-judgement/1");

/// Position errors in one state of the robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StateErrors {
    /// Mean, mm; null without errors.
    pub mean_mm: Option<f64>,
    /// The error below which 95 % of the poses lie, mm; null without errors.
    pub p95_mm: Option<f64>,
    /// Largest, mm; null without errors.
    pub max_mm: Option<f64>,
    /// Mean of the angles by which measured orientations are off, deg; not there without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation_mean_deg: Option<f64>,
    /// Number of poses that meet the tolerance; not there without errors, or without a tolerance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub met: Option<usize>,
    /// Number of poses in each of equal classes from zero to `classes_to_mm`; empty without errors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub counts: Vec<usize>,
    /// The reason why there are no errors; otherwise not there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absent: Option<String>,
}

/// Number of classes of a histogram.
const CLASSES: usize = 24;

impl StateErrors {
    /// The errors of a state, in classes up to `largest`, m.
    fn of(row: &ErrorRow, tolerance: Option<f64>, largest: f64) -> Self {
        let of = |f: fn(&calibench::residuals::Validation) -> f64| row.errors.as_ref().ok().map(|v| f(v) / MM);
        let class = |error: &f64| ((error / largest * CLASSES as f64) as usize).min(CLASSES - 1);
        let counted = row.errors.as_ref().ok().filter(|_| largest > 0.0).map(|v| {
            let mut counts = vec![0; CLASSES];
            v.errors.iter().filter(|error| error.is_finite()).for_each(|error| counts[class(error)] += 1);
            counts
        });
        StateErrors {
            counts: counted.unwrap_or_default(),
            mean_mm: of(|v| v.mean),
            p95_mm: of(|v| v.quantiles[4]),
            max_mm: of(|v| v.max),
            orientation_mean_deg: row.errors.as_ref().ok().and_then(|v| v.orientation).map(|o| o.mean / DEG),
            met: row.errors.as_ref().ok().zip(tolerance).map(|(v, tolerance)| v.within(tolerance)),
            absent: row.errors.as_ref().err().map(ToString::to_string),
        }
    }
}

/// Position errors before a calibration and after it, at the same poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BeforeAndAfter {
    /// True if the poses were held out of the fit.
    pub held_out: bool,
    /// Number of samples fitted.
    pub fitted: usize,
    /// Number of poses judged.
    pub judged: usize,
    /// The largest error of all states, mm, up to which the classes of their histograms go; not there without errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub classes_to_mm: Option<f64>,
    /// The errors of measured orientations in words; not there without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<String>,
    /// What the controller reaches: against commanded positions, or the nominal arm on its base and with its tool as stated.
    pub as_delivered: StateErrors,
    /// Nominal arm, base and free tool fitted.
    pub nominal: StateErrors,
    /// Calibrated with the first model.
    pub calibrated: StateErrors,
    /// Calibrated with the recommended model.
    pub recommended: StateErrors,
}

impl BeforeAndAfter {
    /// The errors of a table, with the number of poses that meet a tolerance (m), if there is one.
    #[must_use]
    pub fn of(errors: &calibench::judgement::ErrorTable, tolerance: Option<f64>) -> Self {
        let largest = errors.rows.iter().filter_map(|row| row.errors.as_ref().ok()).map(|v| v.max).fold(0.0, f64::max);
        let [as_delivered, nominal, calibrated, recommended] =
            errors.rows.each_ref().map(|row| StateErrors::of(row, tolerance, largest));
        debug_assert!(errors.rows[0].stage == Stage::AsDelivered);
        let judged = errors.last().map_or(0, |v| v.samples);
        BeforeAndAfter {
            held_out: errors.held_out,
            fitted: errors.fitted,
            judged,
            classes_to_mm: (largest > 0.0).then_some(largest / MM),
            orientation: orientation_sentence(errors),
            as_delivered,
            nominal,
            calibrated,
            recommended,
        }
    }
}

/// Position errors to expect, at named places; null where they cannot be predicted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExpectedAt {
    /// At the poses held out.
    pub held_out: Option<Workspace>,
    /// Inside the measured ranges of the joints.
    pub inside: Option<Workspace>,
    /// Over the limits of the joints.
    pub over_limits: Option<Workspace>,
}

/// How a robot was, how it is, and what to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Judged {
    /// Format tag.
    pub format: JudgedFormat,
    /// True if the masses of the links are guessed from the reach of the arm.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub masses_guessed: bool,
    /// The errors measured.
    pub errors: BeforeAndAfter,
    /// The errors to expect of the recommended model.
    pub expected: ExpectedAt,
    /// Verdict on what the first model leaves.
    pub verdict: String,
    /// Its cause in words.
    pub cause: String,
    /// The advice on the model that is recommended: `nothing`, `unknown`, `distinguish` or `stop`.
    pub to_do: String,
    /// What to do, in order.
    pub next: Vec<String>,
    /// Largest error that was allowed, mm; null if none was stated.
    pub tolerance_mm: Option<f64>,
    /// Why the data do not fit their robot; only if they were used by force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<String>,
}

impl Judged {
    /// The document of a judgement, with the tolerance (m) if there is one; without the advice in words.
    #[must_use]
    pub fn of(judgement: &Judgement, tolerance: Option<f64>) -> Self {
        let expected = &judgement.expected;
        let [held_out, inside, over_limits] =
            [&expected.held_out, &expected.inside, &expected.over_limits].map(|e| e.as_ref().map(Workspace::of));
        Judged {
            format: JudgedFormat::Current,
            masses_guessed: judgement.cause.masses_guessed,
            errors: BeforeAndAfter::of(&judgement.errors, tolerance),
            expected: ExpectedAt { held_out, inside, over_limits },
            verdict: judgement.cause.verdict.name().into(),
            cause: cause_words(&judgement.cause),
            to_do: judgement.advice.to_do.name().into(),
            next: Vec::new(),
            tolerance_mm: tolerance.map(|t| t / MM),
            misfit: None,
        }
    }
}
