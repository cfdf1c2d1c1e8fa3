//! The keys of a scenario file, as written: units are in the names, meanings and defaults in docs/scenarios.md.

use std::collections::BTreeMap;

use calibench::identify::OwnEffectTable;
use serde::Deserialize;

use super::truth_keys::TruthToml;
use crate::plant::PlantKind;
use crate::precision::PrecisionToml;
use crate::study::SweepToml;
use crate::suite::SuiteToml;

/// A scenario as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // the keys of the file, described in docs/scenarios.md
pub struct ScenarioToml {
    pub format: String,
    pub name: String,
    pub question: String,
    pub seed: u64,
    #[serde(default)]
    pub plant: PlantKind,
    pub robot: String,
    pub gravity_m_s2: [f64; 3],
    pub base: BaseToml,
    pub tool: ToolToml,
    #[serde(rename = "payload")]
    pub payloads: Vec<PayloadToml>,
    #[serde(rename = "ball")]
    pub balls: Vec<BallToml>,
    pub noise: NoiseToml,
    #[serde(rename = "solid", default)]
    pub solids: Vec<SolidToml>,
    #[serde(default)]
    pub carried: Vec<CarriedToml>,
    pub plan: PlanToml,
    pub centring: CentringToml,
    pub tracker: TrackerToml,
    pub model: ModelToml,
    pub truth: TruthToml,
    #[serde(default)]
    pub expect: BTreeMap<String, [f64; 2]>,
    #[serde(default)]
    pub precision: PrecisionToml,
    pub suite: Option<SuiteToml>,
    pub sweep: Option<SweepToml>,
}

/// The base: position, then turns about z, y, x.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct BaseToml {
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    #[serde(default)]
    pub a_deg: f64,
    #[serde(default)]
    pub b_deg: f64,
    #[serde(default)]
    pub c_deg: f64,
}

/// The TCP frame: position, then turns about z, y, x; and how surely the position is known.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct ToolToml {
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    #[serde(default)]
    pub a_deg: f64,
    #[serde(default)]
    pub b_deg: f64,
    #[serde(default)]
    pub c_deg: f64,
    #[serde(default)]
    pub sigma_um: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct PayloadToml {
    pub name: String,
    pub mass_kg: f64,
    pub com_mm: [f64; 3],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct BallToml {
    pub id: String,
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    #[serde(default)]
    pub sigma_um: f64,
    #[serde(default = "up")]
    pub outward: [f64; 3],
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct NoiseToml {
    pub ball_um: f64,
    pub point_um: f64,
    pub joint_arcsec: Vec<f64>,
}

/// A body that stands in the cell: a box (`min_mm`, `max_mm`) or a capsule (`from_mm`, `to_mm`, `radius_mm`).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct SolidToml {
    pub name: String,
    #[serde(default)]
    pub on_artifact: bool,
    pub min_mm: Option<[f64; 3]>,
    pub max_mm: Option<[f64; 3]>,
    pub from_mm: Option<[f64; 3]>,
    pub to_mm: Option<[f64; 3]>,
    pub radius_mm: Option<f64>,
}

/// A body on the flange, written in the same way.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct CarriedToml {
    pub name: String,
    pub min_mm: Option<[f64; 3]>,
    pub max_mm: Option<[f64; 3]>,
    pub from_mm: Option<[f64; 3]>,
    pub to_mm: Option<[f64; 3]>,
    pub radius_mm: Option<f64>,
}

/// In which order the balls are probed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Turn by turn: drift cannot pass for a ball's error.
    Interleaved,
    /// All poses of one ball, then the next, as the paper does.
    BallByBall,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct PlanToml {
    pub poses_per_ball: usize,
    pub reserves_per_ball: usize,
    #[serde(default)]
    pub reversed_poses: usize,
    #[serde(default)]
    pub light_poses: usize,
    #[serde(default)]
    pub point_poses: usize,
    pub pool_per_ball: usize,
    pub starts: usize,
    pub cone_deg: f64,
    pub retreat_mm: f64,
    pub clearance_mm: f64,
    pub order: Order,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct CentringToml {
    pub tolerance_um: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct TrackerToml {
    pub position_mm: [f64; 3],
    pub facing_deg: f64,
    pub identification_poses: usize,
    pub validation_poses: usize,
    pub nests_mm: [[f64; 3]; 3],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct ModelToml {
    pub effects: Vec<String>,
    /// The user's own.
    #[serde(default)]
    pub effect: Vec<OwnEffectTable>,
}
