//! The keys of a scenario's `[sweep]`.

use serde::Deserialize;
use toml::{Table, Value};

/// The keys under `[sweep]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // described in docs/scenarios.md
pub struct SweepToml {
    #[serde(default)]
    pub design: Design,
    pub points: Option<usize>,
    #[serde(rename = "axis")]
    pub axes: Vec<AxisToml>,
}

/// Distribution of the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Design {
    /// All combinations of the values of all axes.
    #[default]
    Factorial,
    /// A Sobol sequence, Owen-scrambled: fills the space evenly with any number of points.
    Sobol,
}

/// An axis of the sweep, which varies from point to point.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct AxisToml {
    pub key: Option<String>,
    pub name: Option<String>,
    pub values: Option<Vec<Value>>,
    pub from: Option<f64>,
    pub to: Option<f64>,
    pub steps: Option<usize>,
    #[serde(default)]
    pub scale: Scale,
    #[serde(rename = "case", default)]
    pub cases: Vec<CaseToml>,
}

/// Division of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// By equal differences.
    #[default]
    Linear,
    /// By equal ratios.
    Log,
}

/// Several keys changed at once.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct CaseToml {
    pub label: String,
    #[serde(default)]
    pub set: Table,
    #[serde(default)]
    pub without: Vec<String>,
}
