//! The keys of `cell.toml`, and their defaults.

use std::path::PathBuf;

use serde::Deserialize;

use crate::cell::gauge::IndicatorKeys;
use crate::cell::{GuardsKeys, RobotKind, TriCalKeys};
use crate::measure::campaign::mastering::MasteringSettings;
use crate::measure::centring::CentringSettings;
use crate::units::{MM, UM};

/// A real cell: its robot and its indicators, their addresses and their limits.
//
// With the keys of one kind of robot.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct CellToml<R> {
    /// Name and version of this format.
    #[cfg_attr(feature = "schema", schemars(extend("const" = super::CELL_FORMAT)))]
    pub format: String,
    /// A `dataset.toml`, relative to this file: robot model, base, tool, payloads, balls and noise. The measured dataset
    /// inherits them.
    pub dataset: PathBuf,
    /// A scenario of the same cell, relative to this file: the settings of `plan`, and the bodies around the arm where
    /// `surroundings` is not given.
    pub scenario: Option<PathBuf>,
    /// The bodies around the arm, in addition to the balls of the dataset: `plan` keeps clear of them, and so does the
    /// first motion of `measure` where the arm is on no motion of its plan.
    pub surroundings: Option<SurroundingsToml>,
    /// The controller.
    pub robot: R,
    /// The indicators of the gauge: three, one for each axis of the tool. None in a cell that measures points by an instrument.
    #[serde(default)]
    #[cfg_attr(feature = "schema", schemars(length(max = 3)))]
    pub indicator: Vec<IndicatorKeys>,
    /// Limits on the motion of the arm.
    #[serde(default)]
    pub guards: GuardsKeys,
    /// The gauge and its balls.
    #[serde(default)]
    pub trical: TriCalKeys,
    /// Conditions under which a ball counts as centred.
    #[serde(default)]
    pub centring: CentringToml,
    /// Limits that the mastering of the indicators accepts.
    #[serde(default)]
    pub mastering: MasteringToml,
}

/// The bodies around the arm.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct SurroundingsToml {
    /// A `scene.toml`, relative to this file: table, artifact and other bodies fixed in the cell, and those on the flange.
    /// The balls are those of the dataset.
    pub scene: PathBuf,
}

/// First pass: the kind of robot, which determines how the rest is read.
#[derive(Deserialize)]
pub(super) struct KindToml {
    #[serde(default)]
    pub robot: KindOfRobot,
}

#[derive(Deserialize, Default)]
pub(super) struct KindOfRobot {
    pub kind: Option<RobotKind>,
}

/// Settings of the centring.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(super) struct CentringToml {
    /// A ball is centred when every reading is smaller, um.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub tolerance_um: f64,
    /// Readings averaged at each stop.
    pub readings: usize,
    /// Most steps of one centring.
    pub max_steps: usize,
}

impl Default for CentringToml {
    fn default() -> Self {
        let CentringSettings { tolerance, readings, max_steps, .. } = CentringSettings::default();
        CentringToml { tolerance_um: tolerance / UM, readings, max_steps }
    }
}

/// Settings of the mastering.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(super) struct MasteringToml {
    /// Largest difference between successive readings of a plunger at rest, um.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub stable_within_um: f64,
    /// Largest distance of an indicator from its ideal place along its channel, mm.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    pub placed_within_mm: f64,
}

impl Default for MasteringToml {
    fn default() -> Self {
        let MasteringSettings { stable_within, placed_within, .. } = MasteringSettings::default();
        MasteringToml { stable_within_um: stable_within / UM, placed_within_mm: placed_within / MM }
    }
}
