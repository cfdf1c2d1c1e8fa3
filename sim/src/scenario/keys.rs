//! The keys of a scenario file: units are in the names, meanings and defaults in docs/scenarios.md.

use std::collections::BTreeMap;

use calibench::identify::OwnEffectTable;
use nalgebra::Vector3;
use serde::Deserialize;

use super::design_keys::DesignToml;
use super::instrument_keys::InstrumentToml;
use super::precision_keys::PrecisionToml;
use super::sweep_keys::SweepToml;
use super::truth_keys::TruthToml;
use crate::contact::DATUM_RADIUS;
use crate::gauge::Gauge;
use crate::plunger::{PlungerSpec, PresentedBall};
use crate::random::Streams;

/// A scenario as in its file.
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
    #[serde(default)]
    pub indicators: IndicatorsToml,
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
    /// The user's own effects; the same as `[[model.effect]]`.
    #[serde(rename = "effect", default)]
    pub effects: Vec<OwnEffectTable>,
    pub truth: TruthToml,
    #[serde(default)]
    pub expect: BTreeMap<String, [f64; 2]>,
    #[serde(default)]
    pub precision: PrecisionToml,
    #[serde(default)]
    pub instrument: InstrumentToml,
    pub suite: Option<SuiteToml>,
    pub sweep: Option<SweepToml>,
    pub design: Option<DesignToml>,
}

/// The base: position, then rotations about z, y, x.
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

/// The TCP frame: position, then rotations about z, y, x; and the uncertainty of the position.
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

/// Data sheet of the gauge's indicators: the force of their springs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[allow(missing_docs)]
pub struct IndicatorsToml {
    pub preload_n: f64,
    pub full_force_n: f64,
}

impl Default for IndicatorsToml {
    /// A digital indicator of 12.5 mm (assumed).
    fn default() -> Self {
        IndicatorsToml { preload_n: 0.65, full_force_n: 0.90 }
    }
}

impl IndicatorsToml {
    /// Force of the three plungers on the tool with a ball centred, tool axes, N.
    pub fn contact_force(&self) -> Vector3<f64> {
        let spring = PlungerSpec { preload: self.preload_n, full_force: self.full_force_n, ..PlungerSpec::ideal() };
        let gauge = Gauge::draw(&spring, &Streams { seed: 0, trial: 0 });
        gauge.force_from(Some(&PresentedBall { centre: Vector3::zeros(), radius: DATUM_RADIUS }))
    }
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

/// A body fixed in the cell: a box (`min_mm`, `max_mm`) or a capsule (`from_mm`, `to_mm`, `radius_mm`).
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

/// A body on the flange, specified like a [`SolidToml`].
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

/// Order in which the balls are probed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Balls in rotation: drift cannot be mistaken for an error of a ball.
    Interleaved,
    /// Balls in rotation, ordered for a shorter tour.
    InterleavedShort,
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
    /// The user's own effects.
    #[serde(default)]
    pub effect: Vec<OwnEffectTable>,
}

/// The keys under `[suite]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // described in docs/scenarios.md
pub struct SuiteToml {
    /// Sizes of a single hidden effect, in units of its plausible size.
    pub sizes: Vec<f64>,
    /// Trials of each effect and size.
    pub trials_per_effect: usize,
    /// Trials with nothing hidden; the same number again with the noise understated.
    pub trials_of_nothing: usize,
    /// Factor by which the noise is then understated.
    pub noise_wrong: f64,
    /// Sizes of clutter, in units of the plausible size, and trials of each.
    pub clutter: Vec<f64>,
    pub trials_of_clutter: usize,
    /// Trials with all effects at once, at sizes of every order of magnitude.
    pub trials_of_dense: usize,
    /// Trials with two effects at once, at twice their plausible size.
    pub trials_of_two: usize,
    /// Sizes of the flaws that no catalogue contains, in units of the plausible size, and trials of each.
    pub unknown_sizes: Vec<f64>,
    pub trials_of_unknown: usize,
    /// Trials with two samples in error by `outlier_mm`.
    #[serde(default)]
    pub trials_of_outliers: usize,
    #[serde(default = "five")]
    pub outlier_mm: f64,
    /// Trials in which a ball is knocked by `moved_ball_mm` during the campaign.
    #[serde(default)]
    pub trials_of_moved_ball: usize,
    #[serde(default = "a_fifth")]
    pub moved_ball_mm: f64,
    /// Trials with one effect or none, and the noise understated by the factor `noise_understated`.
    #[serde(default)]
    pub trials_of_understated: usize,
    #[serde(default = "two")]
    pub noise_understated: f64,
    /// Trials with one effect or none, and joint angles quantised to `quantised_deg`.
    #[serde(default)]
    pub trials_of_quantised: usize,
    #[serde(default = "a_hundredth")]
    pub quantised_deg: f64,
    /// Trials with one effect or none, and `few_samples` samples.
    #[serde(default)]
    pub trials_of_few: usize,
    #[serde(default = "thirty")]
    pub few_samples: usize,
    /// Scenarios of other robots, relative to this one, and trials of each with one effect or none.
    #[serde(default)]
    pub robots: Vec<String>,
    #[serde(default)]
    pub trials_of_robot: usize,
}

fn five() -> f64 {
    5.0
}

fn a_fifth() -> f64 {
    0.2
}

fn two() -> f64 {
    2.0
}

fn a_hundredth() -> f64 {
    0.01
}

fn thirty() -> usize {
    30
}

/// Plants that simulate the mechanics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlantKind {
    /// Closed forms: screws of the arm, geometry of the contact.
    #[default]
    Analytic,
    /// MuJoCo, a physics engine that shares no code with the model.
    Mujoco,
}

impl PlantKind {
    /// Name used in files.
    pub fn name(self) -> &'static str {
        match self {
            PlantKind::Analytic => "analytic",
            PlantKind::Mujoco => "mujoco",
        }
    }
}

/// Number of poses to select from for the tracker: spread over the whole workspace.
pub const TRACKER_POOL: usize = 2000;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{FREE_READING, TRAVEL};

    #[test]
    fn a_centred_ball_pushes_along_every_axis_as_the_data_sheet_says() {
        let stated = IndicatorsToml { preload_n: 0.5, full_force_n: 1.0 };
        // A centred ball reads zero.
        let spring = 0.5 + 0.5 * -FREE_READING / TRAVEL;
        for force in stated.contact_force().iter() {
            assert!((force.abs() - spring).abs() < 1e-12, "{force} N for {spring} N");
        }
    }
}
