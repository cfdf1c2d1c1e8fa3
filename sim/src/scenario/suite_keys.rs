//! Keys of a suite: how many robots with which flaws the diagnosis is tried on.

use serde::Deserialize;

/// The keys under `[suite]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SuiteToml {
    /// Sizes of a single hidden effect, in units of its plausible size.
    pub sizes: Vec<f64>,
    /// Trials of each effect and size.
    pub trials_per_effect: usize,
    /// Trials with nothing hidden; the same number again with the noise understated.
    pub trials_of_nothing: usize,
    /// Factor by which the noise is then understated.
    pub noise_wrong: f64,
    /// Sizes of clutter, in units of the plausible size, and trials of each.
    pub clutter: Vec<f64>,
    /// Trials of each size.
    pub trials_of_clutter: usize,
    /// Trials with all effects at once, at sizes of every order of magnitude.
    pub trials_of_dense: usize,
    /// Trials with two effects at once, at twice their plausible size.
    pub trials_of_two: usize,
    /// Sizes of the flaws that no catalogue contains, in units of the plausible size, and trials of each.
    pub unknown_sizes: Vec<f64>,
    /// Trials of each flaw and size.
    pub trials_of_unknown: usize,
    /// Trials with two samples in error by `outlier_mm`.
    #[serde(default)]
    pub trials_of_outliers: usize,
    /// Size of the outliers, mm.
    #[serde(default = "five")]
    pub outlier_mm: f64,
    /// Trials in which a ball is knocked by `moved_ball_mm` during the campaign.
    #[serde(default)]
    pub trials_of_moved_ball: usize,
    /// Its displacement, mm.
    #[serde(default = "a_fifth")]
    pub moved_ball_mm: f64,
    /// Trials with one effect or none, and the noise understated by the factor `noise_understated`.
    #[serde(default)]
    pub trials_of_understated: usize,
    /// Factor by which the noise is then stated too small.
    #[serde(default = "two")]
    pub noise_understated: f64,
    /// Trials with one effect or none, and joint angles quantised to `quantised_deg`.
    #[serde(default)]
    pub trials_of_quantised: usize,
    /// Step of the quantisation, deg.
    #[serde(default = "a_hundredth")]
    pub quantised_deg: f64,
    /// Trials with one effect or none, and `few_samples` samples.
    #[serde(default)]
    pub trials_of_few: usize,
    /// Number of samples; at least one for each ball.
    #[serde(default = "thirty")]
    pub few_samples: usize,
    /// Scenarios of other robots, relative to this one, and trials of each with one effect or none.
    #[serde(default)]
    pub robots: Vec<String>,
    /// Trials of each robot.
    #[serde(default)]
    pub trials_of_robot: usize,
}

fn five() -> f64 {
    5.0
}

fn a_fifth() -> f64 {
    0.2
}

fn two() -> f64 {
    2.0
}

fn a_hundredth() -> f64 {
    0.01
}

fn thirty() -> usize {
    30
}
