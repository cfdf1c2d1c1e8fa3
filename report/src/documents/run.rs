//! `calibench-run/2`: `result.json` of a run folder, also printed by `run`.

use std::collections::BTreeMap;
use std::path::Path;

use calibench::files::FileError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Calibration, Validation, format_tag};

format_tag!(RunFormat, "calibench-run/2");

/// A parameter against the ground truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScoredParameter {
    /// Name.
    pub name: String,
    /// True value in the simulated cell, in `unit`.
    pub truth: f64,
    /// Estimate, in `unit`.
    pub estimate: f64,
    /// One-sigma, in `unit`; null if undetermined.
    pub sigma: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
}

/// A method of calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RunMethod {
    /// `trical` or `tracker`.
    pub name: String,
    /// Number of samples.
    pub probings: usize,
    /// Mean number of readings of a centring; absent for the tracker.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readings_mean: Option<f64>,
    /// Position errors at the validation poses.
    pub validation: Validation,
    /// The identified robot.
    pub calibration: Calibration,
    /// Estimates against the ground truth.
    pub score: Vec<ScoredParameter>,
}

/// True position errors of the tool at targets sent to the robot's own controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CompensationErrors {
    /// Number of targets that could not be compensated.
    pub refused: usize,
    /// Errors at the targets as they are.
    pub before: Validation,
    /// Errors at the fake targets.
    pub after: Validation,
}

/// Errors of the nominal robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BeforeCalibration {
    /// Mean, mm.
    pub mean_mm: f64,
    /// Largest, mm.
    pub max_mm: f64,
}

/// Errors that the paper states.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PaperErrors {
    /// Mean, mm.
    pub mean_mm: f64,
    /// Largest, mm.
    pub max_mm: f64,
    /// Standard deviation, mm.
    pub std_mm: f64,
}

/// A parameter of a hidden effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HiddenParameter {
    /// Name.
    pub name: String,
    /// True value, in `unit`.
    pub truth: f64,
    /// Estimate, in `unit`; null if not estimated.
    pub estimate: Option<f64>,
    /// Its one-sigma, in `unit`.
    pub sigma: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
}

/// An effect hidden in the simulated cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HiddenEffect {
    /// Id of the effect.
    pub effect: String,
    /// Its size in words.
    pub size: String,
    /// Its size in plausible sizes; null if it has none.
    pub plausible_sizes: Option<f64>,
    /// Its parameters.
    pub parameters: Vec<HiddenParameter>,
    /// True if the model has it.
    pub in_model: bool,
    /// Method by which it was found.
    pub found: String,
    /// The part of it that the data show, in units of the noise; null if unknown.
    pub visible_over_noise: Option<f64>,
}

/// Result of the diagnosis.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Named {
    /// The verdict.
    pub verdict: String,
    /// The effect named first; null if none.
    pub named_first: Option<String>,
    /// True if that effect is hidden in the cell.
    pub named_first_is_hidden: Option<bool>,
}

/// A figure with its expected band.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExpectedCheck {
    /// Name of the figure.
    pub name: String,
    /// Its value; null if it is not a number.
    pub value: Option<f64>,
    /// The expected band; null for an open end.
    pub band: [Option<f64>; 2],
    /// True if the value is in the band.
    pub met: bool,
}

/// The expectations of a scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Expectations {
    /// True if all are met.
    pub met: bool,
    /// The figures.
    pub checks: Vec<ExpectedCheck>,
}

/// A run of the whole procedure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Run {
    /// Format tag.
    pub format: RunFormat,
    /// Name of the scenario.
    pub scenario: String,
    /// Its question.
    pub question: String,
    /// `analytic` or `mujoco`.
    pub plant: String,
    /// The seed.
    pub seed: u64,
    /// The methods of calibration.
    pub methods: Vec<RunMethod>,
    /// Errors with and without compensation; null if not one target could be compensated.
    pub compensation: Option<CompensationErrors>,
    /// Errors before calibration.
    pub before: BeforeCalibration,
    /// The paper's errors, by method.
    pub paper: BTreeMap<String, PaperErrors>,
    /// Effects hidden in the cell, and what the data show of them.
    pub hidden_against_found: Vec<HiddenEffect>,
    /// Result of the diagnosis.
    pub diagnosed: Named,
    /// Expectations of the scenario.
    pub expect: Expectations,
}

impl Run {
    /// Name of the file in a run folder; it marks the folder as such.
    pub const FILE: &str = "result.json";

    /// Reads the file in a run folder.
    ///
    /// # Errors
    /// If it cannot be read or is not the document of a run; the error names file, line and remedy.
    pub fn read(folder: &Path) -> Result<Self, FileError> {
        super::read(&folder.join(Run::FILE), "give the file as `calibench run` wrote it")
    }
}
