//! The keys of `cell.toml`, and what they are where the file leaves them out.

use std::path::PathBuf;

use serde::Deserialize;

use super::{CentringSettings, MasteringSettings};
use crate::cell::TriCal;
use crate::cell::gauge::Dialect;
use crate::cell::kuka::{Actions, Fitness, Patience, RobotProgram, Variables};
use crate::units::{MM, UM};

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CellToml {
    pub format: String,
    pub dataset: PathBuf,
    pub scenario: Option<PathBuf>,
    pub robot: RobotToml,
    pub indicator: Vec<IndicatorToml>,
    #[serde(default)]
    pub guards: GuardsToml,
    #[serde(default)]
    pub trical: TriCalToml,
    #[serde(default)]
    pub centring: CentringToml,
    #[serde(default)]
    pub mastering: MasteringToml,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotToml {
    pub address: String,
    #[serde(default)]
    pub program: RobotProgram,
    #[serde(default = "slow")]
    pub speed_percent: u8,
    #[serde(default)]
    pub flange: FlangeToml,
    #[serde(default)]
    pub variables: Variables,
    #[serde(default)]
    pub actions: Actions,
    #[serde(default)]
    pub fitness: Fitness,
    #[serde(default)]
    pub patience: PatienceToml,
}

/// One tenth: what a person can follow with a hand on the stop.
fn slow() -> u8 {
    10
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub(super) struct FlangeToml {
    pub x_mm: f64,
    pub y_mm: f64,
    pub z_mm: f64,
    pub a_deg: f64,
    pub b_deg: f64,
    pub c_deg: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct PatienceToml {
    pub connect_s: f64,
    pub answer_s: f64,
    pub motion_s: f64,
    pub poll_ms: f64,
    pub settle_s: f64,
    pub reconnects: usize,
}

impl Default for PatienceToml {
    fn default() -> Self {
        let Patience { connect, answer, motion, poll, settle, reconnects } = Patience::default();
        PatienceToml {
            connect_s: connect.as_secs_f64(),
            answer_s: answer.as_secs_f64(),
            motion_s: motion.as_secs_f64(),
            poll_ms: 1e3 * poll.as_secs_f64(),
            settle_s: settle.as_secs_f64(),
            reconnects,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct IndicatorToml {
    pub axis: AxisToml,
    pub port: Option<String>,
    pub address: Option<String>,
    #[serde(default = "sylvac")]
    pub dialect: String,
    pub line: Option<String>,
    #[serde(default)]
    pub counts_down: bool,
    pub timeout_s: Option<f64>,
    pub echo_s: Option<f64>,
}

fn sylvac() -> String {
    Dialect::SYLVAC.name.into()
}

#[derive(Deserialize, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum AxisToml {
    X,
    Y,
    Z,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct GuardsToml {
    pub max_step_mm: f64,
    pub joint_margin_deg: f64,
    pub workspace_mm: Option<[[f64; 3]; 2]>,
}

impl Default for GuardsToml {
    fn default() -> Self {
        GuardsToml { max_step_mm: LONGEST_STEP / MM, joint_margin_deg: 0.0, workspace_mm: None }
    }
}

/// No step is ever longer, m: the paper's safe range of the gauge (section 2.1).
pub(super) const LONGEST_STEP: f64 = TriCal::PAPER.safe_range;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct TriCalToml {
    pub datum_diameter_mm: f64,
    pub master_diameter_mm: f64,
    pub travel_mm: f64,
    pub tip_diameter_mm: f64,
}

impl Default for TriCalToml {
    fn default() -> Self {
        let TriCal { datum_radius, master_radius, travel, tip_radius, .. } = TriCal::PAPER;
        TriCalToml {
            datum_diameter_mm: 2.0 * datum_radius / MM,
            master_diameter_mm: 2.0 * master_radius / MM,
            travel_mm: travel / MM,
            tip_diameter_mm: 2.0 * tip_radius / MM,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct CentringToml {
    pub tolerance_um: f64,
    pub readings: usize,
    pub max_steps: usize,
}

impl Default for CentringToml {
    fn default() -> Self {
        let CentringSettings { tolerance, readings, max_steps, .. } = CentringSettings::default();
        CentringToml { tolerance_um: tolerance / UM, readings, max_steps }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct MasteringToml {
    pub stable_within_um: f64,
    pub placed_within_mm: f64,
}

impl Default for MasteringToml {
    fn default() -> Self {
        let MasteringSettings { stable_within, placed_within, .. } = MasteringSettings::default();
        MasteringToml { stable_within_um: stable_within / UM, placed_within_mm: placed_within / MM }
    }
}
