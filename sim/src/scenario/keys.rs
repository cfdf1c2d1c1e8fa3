//! The keys of a scenario file: units are in the names, meanings and defaults in docs/scenarios.md.

use std::collections::BTreeMap;

use calibench::identify::model_file::OwnEffectTable;
use nalgebra::Vector3;
use serde::Deserialize;

use super::design_keys::DesignToml;
use super::instrument_keys::InstrumentToml;
use super::precision_keys::PrecisionToml;
use super::suite_keys::SuiteToml;
use super::sweep_keys::SweepToml;
use super::truth_keys::TruthToml;
use crate::contact::DATUM_RADIUS;
use crate::gauge::Gauge;
use crate::plunger::{PlungerSpec, PresentedBall};
use crate::random::Streams;

/// A scenario as in its file.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ScenarioToml {
    /// Name and version of this format.
    #[cfg_attr(feature = "schema", schemars(extend("const" = super::FORMAT)))]
    pub format: String,
    /// Short name, printed and written to the results.
    pub name: String,
    /// The question that this scenario answers, in one sentence.
    pub question: String,
    /// Whole number; the same seed gives the same results to the last bit, on any number of threads.
    pub seed: u64,
    /// Simulation of the mechanics: `"analytic"` (closed forms) or `"mujoco"` (needs a program built with MuJoCo); `--plant`
    /// overrides it.
    #[serde(default)]
    pub plant: PlantKind,
    /// A built-in robot (`calibench robots`), a robot file or a URDF, relative to the scenario.
    pub robot: String,
    /// Gravity in the world frame, m/s².
    pub gravity_m_s2: [f64; 3],
    /// Nominal position of the robot.
    pub base: BaseToml,
    /// TCP frame in the flange frame, as certified.
    pub tool: ToolToml,
    /// Data sheet values of the indicators.
    #[serde(default)]
    pub indicators: IndicatorsToml,
    /// Loads on the flange; the first is used by default, the second for light poses.
    #[serde(rename = "payload")]
    pub payloads: Vec<PayloadToml>,
    /// The balls of the artifact, as certified.
    #[serde(rename = "ball")]
    pub balls: Vec<BallToml>,
    /// The noise stated to the identification.
    pub noise: NoiseToml,
    /// Bodies in the cell, world frame.
    #[serde(rename = "solid", default)]
    pub solids: Vec<SolidToml>,
    /// Bodies on the flange, flange frame.
    #[serde(default)]
    pub carried: Vec<CarriedToml>,
    /// Search for and selection of poses.
    pub plan: PlanToml,
    /// Tolerance of a centred ball.
    pub centring: CentringToml,
    /// The laser tracker.
    pub tracker: TrackerToml,
    /// Effects that the identification may use.
    pub model: ModelToml,
    /// The user's own effects; the same as `[[model.effect]]`.
    #[serde(rename = "effect", default)]
    pub effects: Vec<OwnEffectTable>,
    /// The ground truth.
    pub truth: TruthToml,
    /// The expected results.
    #[serde(default)]
    pub expect: BTreeMap<String, [f64; 2]>,
    /// The precision test of the gauge, for `calibench sim precision`.
    #[serde(default)]
    pub precision: PrecisionToml,
    /// The instrument that measures the robot, for `calibench sim study`.
    #[serde(default)]
    pub instrument: InstrumentToml,
    /// Blind trials of the diagnosis, for `calibench sim suite`.
    pub suite: Option<SuiteToml>,
    /// The points at which `calibench sim study` makes its trials.
    pub sweep: Option<SweepToml>,
    /// The parts from which `calibench sim design` may build an artifact.
    pub design: Option<DesignToml>,
}

/// The base: position, then rotations about z, y, x.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct BaseToml {
    /// Nominal base in the world; initial value of the identification, mm.
    pub x_mm: f64,
    /// The same along y, mm.
    pub y_mm: f64,
    /// The same along z, mm.
    pub z_mm: f64,
    /// Turn about z, deg.
    #[serde(default)]
    pub a_deg: f64,
    /// Then about y, deg.
    #[serde(default)]
    pub b_deg: f64,
    /// Then about x, deg.
    #[serde(default)]
    pub c_deg: f64,
}

/// The TCP frame: position, then rotations about z, y, x; and the uncertainty of the position.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ToolToml {
    /// TCP in the flange frame, mm.
    pub x_mm: f64,
    /// The same along y, mm.
    pub y_mm: f64,
    /// The same along z, mm.
    pub z_mm: f64,
    /// Turn about z, deg.
    #[serde(default)]
    pub a_deg: f64,
    /// Then about y, deg.
    #[serde(default)]
    pub b_deg: f64,
    /// Then about x, deg.
    #[serde(default)]
    pub c_deg: f64,
    /// One-sigma of each coordinate of the TCP; enters the fit as a stated parameter; 0 means exact, um.
    #[serde(default)]
    pub sigma_um: f64,
}

/// Data sheet of the gauge's indicators: the force of their springs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct IndicatorsToml {
    /// Stated force of the extended plunger, N.
    pub preload_n: f64,
    /// Stated force at the end of the travel; linear in between, N.
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

/// A load on the flange.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PayloadToml {
    /// Its name in datasets.
    pub name: String,
    /// Total mass carried by the flange, kg.
    pub mass_kg: f64,
    /// Its centre of mass, flange frame, mm.
    pub com_mm: [f64; 3],
}

/// A ball of the artifact, as certified.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct BallToml {
    /// Unique name.
    pub id: String,
    /// Centre in the world, as certified, mm.
    pub x_mm: f64,
    /// The same along y, mm.
    pub y_mm: f64,
    /// The same along z, mm.
    pub z_mm: f64,
    /// One-sigma of each coordinate; enters the fit as a stated parameter; 0 means exact, um.
    #[serde(default)]
    pub sigma_um: f64,
    /// Direction away from the stem, world frame; the axis of the cone of approaches.
    #[serde(default = "up")]
    pub outward: [f64; 3],
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// The noise stated to the identification.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct NoiseToml {
    /// One-sigma per axis of one centring, um.
    pub ball_um: f64,
    /// One-sigma per axis of one tracker point, um.
    pub point_um: f64,
    /// One-sigma of the joint errors that the encoders do not see, one number per joint, arc s.
    pub joint_arcsec: Vec<f64>,
}

/// A body fixed in the cell: a box (`min_mm`, `max_mm`) or a capsule (`from_mm`, `to_mm`, `radius_mm`).
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SolidToml {
    /// Name of the body.
    pub name: String,
    /// True if it is removed, with the balls, before the tracker measures.
    #[serde(default)]
    pub on_artifact: bool,
    /// Box: lower corner, world frame, mm.
    pub min_mm: Option<[f64; 3]>,
    /// Box: upper corner, mm.
    pub max_mm: Option<[f64; 3]>,
    /// Capsule: one end of its axis, mm.
    pub from_mm: Option<[f64; 3]>,
    /// Capsule: the other end, mm.
    pub to_mm: Option<[f64; 3]>,
    /// Capsule: radius, mm.
    pub radius_mm: Option<f64>,
}

/// A body on the flange, specified like a [`SolidToml`].
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CarriedToml {
    /// Name of the body.
    pub name: String,
    /// Box: lower corner, flange frame, mm.
    pub min_mm: Option<[f64; 3]>,
    /// Box: upper corner, mm.
    pub max_mm: Option<[f64; 3]>,
    /// Capsule: one end of its axis, mm.
    pub from_mm: Option<[f64; 3]>,
    /// Capsule: the other end, mm.
    pub to_mm: Option<[f64; 3]>,
    /// Capsule: radius, mm.
    pub radius_mm: Option<f64>,
}

/// Order in which the balls are probed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Balls in rotation: drift cannot be mistaken for an error of a ball.
    Interleaved,
    /// Balls in rotation, ordered for a shorter tour.
    InterleavedShort,
    /// All poses of one ball, then the next, as the paper does.
    BallByBall,
}

/// Search for and selection of poses.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PlanToml {
    /// Probings of each ball.
    pub poses_per_ball: usize,
    /// Additional poses of each ball, chosen with the others, that replace those that cannot be centred.
    pub reserves_per_ball: usize,
    /// Probings repeated, alternating between the balls, with every joint finally arriving from the other side.
    #[serde(default)]
    pub reversed_poses: usize,
    /// Additional probings, distributed over the balls, with the second payload.
    #[serde(default)]
    pub light_poses: usize,
    /// Points by tracker, chosen by O1 through the whole workspace, that are fitted together with the probings.
    #[serde(default)]
    pub point_poses: usize,
    /// Feasible poses of each ball to choose from.
    pub pool_per_ball: usize,
    /// Random starts of the search for the largest O1; the best is kept.
    pub starts: usize,
    /// Largest tilt of the approach from the ball's `outward`, deg.
    pub cone_deg: f64,
    /// Length of the straight approach and retreat, mm.
    pub retreat_mm: f64,
    /// Least distance between any two bodies while a ball is probed; free postures keep 8 mm, since a robot that is not
    /// calibrated yet deviates from its nominal position, mm.
    pub clearance_mm: f64,
    /// `"interleaved"` (alternating between the balls, so that drift cannot appear as the error of a ball), `"interleaved-short"`
    /// (the same in a tour that is 6 % shorter, at a price) or `"ball-by-ball"` (as in the paper).
    pub order: Order,
    /// True if a ball is met where the probings before it say, as in a real cell; false if where it was planned (the paper).
    #[serde(default = "aimed")]
    pub aimed: bool,
}

fn aimed() -> bool {
    true
}

/// Conditions under which a ball counts as centred.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CentringToml {
    /// A ball is centred when all three readings are smaller, um.
    pub tolerance_um: f64,
}

/// The laser tracker.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TrackerToml {
    /// Position of the tracker, world frame, mm.
    pub position_mm: [f64; 3],
    /// Largest angle between the viewing direction of the reflector and the tracker, whose line of sight must not be
    /// obstructed by the arm or the cell; the reflector is not turned from pose to pose, deg.
    pub facing_deg: f64,
    /// Poses of the calibration by tracker, chosen by O1 through the whole workspace.
    pub identification_poses: usize,
    /// Random poses on which both calibrations are judged.
    pub validation_poses: usize,
    /// Three nests that define the world frame, world frame, mm.
    pub nests_mm: [[f64; 3]; 3],
}

/// The effects that the identification may use.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ModelToml {
    /// Ids of effects (`calibench effects`) whose parameters are identified, in any order.
    pub effects: Vec<String>,
    /// The user's own effects.
    #[serde(default)]
    pub effect: Vec<OwnEffectTable>,
}

/// Plants that simulate the mechanics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema, serde::Serialize))]
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
