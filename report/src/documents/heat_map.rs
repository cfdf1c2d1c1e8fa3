//! Evidence for a joint error that follows a variable, part of the document of `diagnose`.

use calibench::diagnosis;
use calibench::units::URAD;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A joint and a variable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeatMapCell {
    /// Joint, counted from 1.
    pub joint: usize,
    /// The variable, as an expression of a model's basis.
    pub against: String,
    /// Natural logarithm of the evidence against noise.
    pub ln_evidence: f64,
    /// Natural logarithm of the evidence against the model discrepancy.
    pub ln_evidence_against_background: f64,
    /// Share of the residual's variance explained.
    pub explains: f64,
}

/// A point of the best curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurvePoint {
    /// Value of the variable, in the curve's unit.
    pub x: f64,
    /// Error of the joint, urad.
    pub mean_urad: f64,
    /// One-sigma, urad.
    pub sigma_urad: f64,
}

/// The cell with the most evidence, and its curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BestCurve {
    /// Joint, counted from 1.
    pub joint: usize,
    /// The variable.
    pub against: String,
    /// Unit of the variable.
    pub x_unit: String,
    /// Error of the joint along the variable.
    pub curve: Vec<CurvePoint>,
}

/// Evidence by joint and variable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeatMap {
    /// The cells.
    pub cells: Vec<HeatMapCell>,
    /// The best cell; null if there is none.
    pub best: Option<BestCurve>,
}

impl HeatMap {
    pub(super) fn of(map: &diagnosis::heat_map::HeatMap) -> Self {
        let cell = |c: &diagnosis::heat_map::Cell| HeatMapCell {
            joint: c.joint + 1,
            against: c.variable.expression(),
            ln_evidence: c.ln_evidence,
            ln_evidence_against_background: c.ln_evidence_against_background,
            explains: c.explains,
        };
        let best = map.best_cell().zip(map.curve.as_ref()).map(|(cell, curve)| {
            let (unit, si) = cell.variable.unit();
            let point = |k: usize| CurvePoint {
                x: curve.at[k] / si,
                mean_urad: curve.mean[k] / URAD,
                sigma_urad: curve.sigma[k] / URAD,
            };
            BestCurve {
                joint: cell.joint + 1,
                against: cell.variable.expression(),
                x_unit: unit.into(),
                curve: (0..curve.at.len()).map(point).collect(),
            }
        });
        HeatMap { cells: map.cells.iter().map(cell).collect(), best }
    }
}
