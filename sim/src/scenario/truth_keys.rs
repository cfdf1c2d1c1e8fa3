//! The keys under `[truth]`: the ground truth, hidden from every model.

use std::collections::BTreeMap;
use std::num::NonZeroU32;

use calibench::units::{MM, MRAD, UM};
use serde::Deserialize;

use super::mujoco_truth::MujocoToml;
use crate::controller::ControllerSpec;
use crate::hidden::HiddenToml;
use crate::plunger::PlungerSpec;
use crate::tracker::TrackerSpec;

/// The truth as in the file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct TruthToml {
    /// Sizes by effect id and parameter (`a1_mm`), or `draw = s`: normal with s times the plausible size.
    #[serde(default)]
    pub effects: BTreeMap<String, BTreeMap<String, f64>>,
    /// Deviation of the effects' shapes from the catalogue's, 0 to 1.
    #[serde(default)]
    pub mismatch: f64,
    /// Flaws unknown to any model.
    #[serde(default)]
    pub hidden: HiddenToml,
    /// Flaws of the mechanism, simulated by the MuJoCo plant only.
    #[serde(default)]
    pub mujoco: MujocoToml,
    /// True mass of each link over its nominal mass, minus one.
    #[serde(default)]
    pub link_mass_error: Vec<f64>,
    /// True deviation of each payload, by its name.
    #[serde(default)]
    pub payload: BTreeMap<String, PayloadTruth>,
    pub indicators: IndicatorTruth,
    pub controller: ControllerSpec,
    pub artifact: ArtifactTruth,
    pub tool: ToolTruth,
    pub tracker: TrackerTruth,
}

/// Deviation of a payload from the values entered.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct PayloadTruth {
    #[serde(default)]
    pub mass_error_kg: f64,
    #[serde(default)]
    pub com_error_mm: [f64; 3],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct IndicatorTruth {
    pub resolution_um: f64,
    pub noise_um: f64,
    pub scale_error_um: f64,
    pub hysteresis_um: f64,
    pub placement_mm: f64,
    pub tilt_mrad: f64,
    pub squareness_mrad: f64,
    pub concurrency_um: f64,
    pub preload_n: f64,
    pub full_force_n: f64,
    pub drop_out: f64,
    pub ball_diameter_um: f64,
    pub ball_form_um: f64,
}

impl IndicatorTruth {
    /// One-sigma of a ball's radius, m.
    pub fn radius_sigma(&self) -> f64 {
        self.ball_diameter_um * UM / 2.0
    }

    /// Flaws of the indicators.
    pub fn plungers(&self) -> PlungerSpec {
        PlungerSpec {
            placement: self.placement_mm * MM,
            orthogonality: self.squareness_mrad * MRAD,
            concurrency: self.concurrency_um * UM,
            disk_tilt: self.tilt_mrad * MRAD,
            scale_amplitude: self.scale_error_um * UM,
            resolution: self.resolution_um * UM,
            hysteresis: [self.hysteresis_um * UM; 2],
            noise: [self.noise_um * UM; 2],
            preload: self.preload_n,
            full_force: self.full_force_n,
            drop_out: self.drop_out,
            ..PlungerSpec::ideal()
        }
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct ArtifactTruth {
    pub ball_sigma_um: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct ToolTruth {
    pub sigma_um: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct TrackerTruth {
    pub sigma_um: f64,
    pub point_shots: NonZeroU32,
    pub nest_shots: NonZeroU32,
}

impl TrackerTruth {
    /// Flaws of the tracker.
    pub fn spec(&self) -> TrackerSpec {
        TrackerSpec { shot: self.sigma_um * UM, point_shots: self.point_shots, nest_shots: self.nest_shots }
    }
}
