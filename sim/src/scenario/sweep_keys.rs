//! The keys of a scenario's `[sweep]`.

use serde::Deserialize;
use toml::{Table, Value};

/// The keys under `[sweep]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SweepToml {
    /// `"factorial"`: all combinations of the values of all axes; `"sobol"`: points of a Sobol sequence (Owen-scrambled), the
    /// same for every seed.
    #[serde(default)]
    pub design: Design,
    /// Number of points; for `"sobol"` only.
    pub points: Option<usize>,
    /// The axes of the sweep.
    #[serde(rename = "axis")]
    pub axes: Vec<AxisToml>,
}

/// Distribution of the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema, serde::Serialize))]
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
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct AxisToml {
    /// The key that changes.
    pub key: Option<String>,
    /// Name of its column.
    pub name: Option<String>,
    /// Its values: numbers, texts, lists or tables.
    #[cfg_attr(feature = "schema", schemars(with = "Option<Vec<serde_json::Value>>"))]
    pub values: Option<Vec<Value>>,
    /// Lower end of the range.
    pub from: Option<f64>,
    /// Upper end; where the scenario has a whole number there, the range is rounded to whole numbers.
    pub to: Option<f64>,
    /// Number of values from the lower to the upper end, at least 2; for a factorial design only.
    pub steps: Option<usize>,
    /// `"linear"`, or `"log"` for equal ratios.
    #[serde(default)]
    pub scale: Scale,
    /// Changes of several keys at once.
    #[serde(rename = "case", default)]
    pub cases: Vec<CaseToml>,
}

/// Division of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema, serde::Serialize))]
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
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CaseToml {
    /// Name of the case in the table.
    pub label: String,
    /// Keys and their new values, `{ "plan.order" = "ball-by-ball" }`.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(with = "std::collections::BTreeMap<String, serde_json::Value>"))]
    pub set: Table,
    /// Keys, or elements of lists, that are removed: `["ball[3]", "solid[7]"]` is an artifact without its fourth ball and the
    /// stem of that ball.
    #[serde(default)]
    pub without: Vec<String>,
}
