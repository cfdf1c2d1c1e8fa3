//! The keys of `cell.toml`, and their defaults.

use std::path::PathBuf;

use serde::Deserialize;

use super::{CentringSettings, MasteringSettings};
use crate::cell::gauge::IndicatorKeys;
use crate::cell::{GuardsKeys, RobotKind, TriCalKeys};
use crate::units::{MM, UM};

/// The whole file, with the keys of one kind of robot.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CellToml<R> {
    pub format: String,
    pub dataset: PathBuf,
    pub scenario: Option<PathBuf>,
    pub robot: R,
    pub indicator: Vec<IndicatorKeys>,
    #[serde(default)]
    pub guards: GuardsKeys,
    #[serde(default)]
    pub trical: TriCalKeys,
    #[serde(default)]
    pub centring: CentringToml,
    #[serde(default)]
    pub mastering: MasteringToml,
}

/// First pass: the kind of robot, which determines how the rest is read.
#[derive(Deserialize)]
pub(super) struct KindToml {
    #[serde(default)]
    pub robot: KindOfRobot,
}

#[derive(Deserialize, Default)]
pub(super) struct KindOfRobot {
    #[serde(default)]
    pub kind: RobotKind,
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
