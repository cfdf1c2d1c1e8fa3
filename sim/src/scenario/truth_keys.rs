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
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
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
    /// Flaws of the three indicators.
    pub indicators: IndicatorTruth,
    /// Flaws of the robot's controller and gears.
    pub controller: ControllerSpec,
    /// Errors of the certificate of the balls.
    pub artifact: ArtifactTruth,
    /// Errors of the certificate of the TCP.
    pub tool: ToolTruth,
    /// Noise of the tracker.
    pub tracker: TrackerTruth,
}

/// Deviation of a payload from the values entered.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PayloadTruth {
    /// True mass minus that entered, kg.
    #[serde(default)]
    pub mass_error_kg: f64,
    /// True centre of mass minus that entered, mm.
    #[serde(default)]
    pub com_error_mm: [f64; 3],
}

/// Flaws of the three indicators, and of the balls.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct IndicatorTruth {
    /// Step of the display; 0 for none, um.
    pub resolution_um: f64,
    /// One-sigma of a reading, um.
    pub noise_um: f64,
    /// Bound of the amplitude of a periodic error of the scale, um.
    pub scale_error_um: f64,
    /// Difference between the readings at the same position reached by pushing in and by coming out, um.
    pub hysteresis_um: f64,
    /// Bound of the deviation of an indicator from its ideal clamping position, mm.
    pub placement_mm: f64,
    /// One-sigma of the disk's tilt about each of two axes, mrad.
    pub tilt_mrad: f64,
    /// One-sigma of the channel's direction about each of two axes, mrad.
    pub squareness_mrad: f64,
    /// One-sigma of the distance at which the channel passes the TCP, along each of two axes, um.
    pub concurrency_um: f64,
    /// Spring force of the extended plunger, N.
    pub preload_n: f64,
    /// Spring force at the end of the travel; linear in between, N.
    pub full_force_n: f64,
    /// Probability that a request gets no answer.
    pub drop_out: f64,
    /// One-sigma of a ball's diameter, um.
    pub ball_diameter_um: f64,
    /// One-sigma per axis of the form error of the ball at each contact, um.
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

/// Errors of the certificate of the balls.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ArtifactTruth {
    /// One-sigma of each coordinate of a ball relative to its certificate, um.
    pub ball_sigma_um: f64,
}

/// Errors of the certificate of the TCP.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ToolTruth {
    /// One-sigma of each coordinate of the TCP relative to its certificate, um.
    pub sigma_um: f64,
}

/// Noise of the tracker.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TrackerTruth {
    /// One-sigma per axis of one reading, um.
    pub sigma_um: f64,
    /// Readings averaged into one point.
    pub point_shots: NonZeroU32,
    /// Readings averaged into each nest.
    pub nest_shots: NonZeroU32,
}

impl TrackerTruth {
    /// Flaws of the tracker.
    pub fn spec(&self) -> TrackerSpec {
        TrackerSpec { shot: self.sigma_um * UM, point_shots: self.point_shots, nest_shots: self.nest_shots }
    }
}
