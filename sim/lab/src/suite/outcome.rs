//! The outcome of one blind trial.

use calibench::diagnosis::Verdict;
use serde::{Serialize, Serializer};

/// The outcome of one trial: ground truth and answer.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[allow(missing_docs)] // the columns of the table of trials
pub struct Outcome {
    pub case: String,
    /// `nothing`, `one`, `two`, `clutter`, `dense`, `unknown`, `outliers` or `moved_ball`.
    pub kind: &'static str,
    /// Ids of the hidden effects, separated by spaces; `everything` for more than two effects.
    pub hidden: String,
    pub size: f64,
    /// The part of them that the fitted model does not absorb, in units of noise.
    pub visible: f64,
    /// True if the data can test them at all.
    pub testable: bool,
    /// Verdict of the diagnosis; `not_measured` in files if there is none, because the balls could not be centred.
    #[serde(serialize_with = "by_name")]
    pub verdict: Option<Verdict>,
    /// The best finding, its probability, and those aliased with it.
    pub top: String,
    pub top_probability: f64,
    pub rivals: String,
    pub top3: String,
    pub set95: String,
    pub top_right: bool,
    pub top_right_merged: bool,
    pub top3_right: bool,
    pub covered: bool,
    pub joint_right: bool,
    /// True if the diagnosis said that no effect of the catalogue is the cause, or named the only catalogue effect equivalent
    /// to the hidden one.
    pub said_so: bool,
    /// The largest contributor of all effects fitted at once, and whether it is the true one.
    pub contributor: String,
    pub contributor_right: bool,
    /// Mean position error over the workspace without the tracker's noise: of the calibration, as predicted by itself, after
    /// following the advice, and with the hidden effect added to the model.
    pub before_mm: f64,
    pub predicted_mm: f64,
    pub after_mm: Option<f64>,
    pub oracle_mm: Option<f64>,
    /// The class to which it belongs.
    pub class: String,
    /// True if the answer is right by the definition of its class.
    pub right: bool,
    /// Chi-square per degree of freedom with the claimed effect.
    pub chi2_left: Option<f64>,
    /// 10 and 90 % quantiles of the predicted error.
    pub predicted_low_mm: f64,
    pub predicted_high_mm: f64,
    /// Mean position error predicted by the advised calibration, with its 10 and 90 % quantiles, if it predicts one.
    pub predicted_after_mm: Option<f64>,
    pub predicted_after_low_mm: Option<f64>,
    pub predicted_after_high_mm: Option<f64>,
}

impl Outcome {
    /// True if an effect of the catalogue was claimed.
    pub fn claimed(&self) -> bool {
        self.verdict.is_some_and(claims)
    }

    /// Name of the verdict in files.
    pub fn verdict_name(&self) -> &'static str {
        name(self.verdict)
    }
}

/// True if a verdict names effects, as the whole or a part of what is missing.
pub(super) fn claims(verdict: Verdict) -> bool {
    verdict.names_effects() || verdict == Verdict::SuspectSamples
}

fn name(verdict: Option<Verdict>) -> &'static str {
    verdict.map_or("not_measured", Verdict::name)
}

// The signature is that of serde.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn by_name<S: Serializer>(verdict: &Option<Verdict>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(name(*verdict))
}
