//! A scenario: one question, the cell that answers it, the ground truth, and the expected results.

mod bodies;
mod check;
mod design_check;
mod design_keys;
mod document;
mod expect;
#[cfg(feature = "schema")]
mod file_schema;
mod instrument_keys;
mod key;
mod keys;
mod mujoco_truth;
mod precision_keys;
mod sources;
mod suite_keys;
mod sweep_keys;
mod truth;
mod truth_keys;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibench::files::FileError;
use calibench::identify::Model;
use calibench::measure::dataset::{Ball, Dataset, Noise};
use calibench::robot::solids::{Solid, Surroundings};
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, Robot};
use calibench::units::{ARCSEC, DEG, MM, UM};
use nalgebra::{Unit, Vector3};

use crate::mechanics::MakePlant;
use crate::tilt::Tilt;
use bodies::Bodies;
pub use design_keys::DesignToml;
pub use document::Document;
pub use expect::{Expectation, Quantity};
#[cfg(feature = "schema")]
pub use file_schema::file_schema;
pub use instrument_keys::{InstrumentKind, InstrumentToml};
pub use key::{Key, KeyError};
pub use keys::{CentringToml, IndicatorsToml, Order, PlanToml, PlantKind, ScenarioToml, TRACKER_POOL, TrackerToml};
pub use mujoco_truth::{Backlash, Bearing, Friction, MujocoToml, Pedestal, Stiffening};
pub use precision_keys::{MOST_REPETITIONS, PrecisionToml};
use sources::Sources;
pub use suite_keys::SuiteToml;
pub use sweep_keys::{AxisToml, CaseToml, Design, Scale, SweepToml};
pub use truth::{StatedEffect, Truth, parameter_key, written_sizes};
pub use truth_keys::{IndicatorTruth, PayloadTruth, TrackerTruth, TruthToml};

/// Format tag of scenario files.
pub const FORMAT: &str = "calibench-scenario/1";

/// A scenario that can be run: every value is checked.
#[derive(Clone)]
pub struct Scenario {
    /// Short name.
    pub name: String,
    /// The question that it answers.
    pub question: String,
    /// Seed of its plan and noise.
    pub seed: u64,
    /// Plant that simulates the mechanics of its cell.
    pub plant: PlantKind,
    /// Settings for finding and choosing poses.
    pub plan: PlanToml,
    /// Criterion for a centred ball.
    pub centring: CentringToml,
    /// Position of the tracker, and number of its measurements.
    pub tracker: TrackerToml,
    /// Model available to the identification.
    pub model: Model,
    /// Expected results.
    pub expect: Vec<Expectation>,
    /// The precision test of its gauge.
    pub precision: PrecisionToml,
    /// Data sheet of the gauge's indicators.
    pub indicators: IndicatorsToml,
    /// Instrument that measures the robot.
    pub instrument: InstrumentToml,
    /// Blind trials of the diagnosis.
    pub suite: Option<SuiteToml>,
    /// Points of a study.
    pub sweep: Option<SweepToml>,
    /// Specification for the design of an artifact.
    pub design: Option<DesignToml>,
    /// Builds the plant `mujoco`, if the program includes it.
    pub mujoco: Option<MakePlant<Scenario>>,
    cell: Dataset,
    outward: Vec<Unit<Vector3<f64>>>,
    bodies: Bodies,
    truth: Truth,
    sources: Arc<Sources>,
}

/// Reads a scenario and the files it extends; every value is checked before anything runs.
///
/// # Errors
/// One error that names file, line, key and remedy.
pub fn load_scenario(path: &Path) -> Result<Scenario, FileError> {
    Document::read(path)?.scenario()
}

/// Builds an empty dataset of the cell: its owner's knowledge.
fn cell(toml: &ScenarioToml, robot: Robot) -> Dataset {
    let (base, tool) = (&toml.base, &toml.tool);
    let frame =
        |xyz_mm: [f64; 3], abc_deg: [f64; 3]| FramePose { xyz: xyz_mm.map(|v| v * MM), rz_ry_rx: abc_deg.map(|v| v * DEG) };
    let payload = |p: &keys::PayloadToml| Payload { name: p.name.clone(), mass: p.mass_kg, com: Vector3::from(p.com_mm) * MM };
    let ball = |b: &keys::BallToml| Ball {
        id: b.id.clone(),
        position: Vector3::new(b.x_mm, b.y_mm, b.z_mm) * MM,
        sigma: b.sigma_um * UM,
        free: false,
    };
    Dataset {
        robot: Arc::new(robot),
        robot_reference: toml.robot.clone(),
        gravity: Vector3::from(toml.gravity_m_s2),
        base: frame([base.x_mm, base.y_mm, base.z_mm], [base.a_deg, base.b_deg, base.c_deg]),
        tool: frame([tool.x_mm, tool.y_mm, tool.z_mm], [tool.a_deg, tool.b_deg, tool.c_deg]),
        tool_sigma: tool.sigma_um * UM,
        payloads: toml.payloads.iter().map(payload).collect(),
        balls: toml.balls.iter().map(ball).collect(),
        noise: Noise {
            ball: Some(toml.noise.ball_um * UM),
            point: Some(toml.noise.point_um * UM),
            joint: toml.noise.joint_arcsec.iter().map(|v| v * ARCSEC).collect(),
            ..Noise::default()
        },
        ..Dataset::default()
    }
}

impl Scenario {
    /// Builds an error for a key of the scenario, in the file that contains it.
    pub fn wrong(&self, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        self.sources.wrong(key, problem, remedy)
    }

    /// Checks that its robot is measured by TriCal, which `verb` requires.
    ///
    /// # Errors
    /// When the scenario names another instrument.
    pub fn expect_trical(&self, verb: &str) -> Result<(), FileError> {
        match self.instrument.kind {
            InstrumentKind::Trical => Ok(()),
            kind => {
                let problem = format!("`{verb}` measures by TriCal alone, not by {}", kind.name());
                Err(self.wrong("instrument.kind", problem, "use `sim study`, or leave the table out"))
            }
        }
    }

    /// Folder of the file with `[suite]`, for paths relative to it.
    pub fn suite_folder(&self) -> PathBuf {
        self.sources.folder_of("suite")
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.cell.robot
    }

    /// Returns an empty dataset of this cell: its owner's knowledge.
    pub fn dataset(&self) -> Dataset {
        self.cell.clone()
    }

    /// Returns an empty dataset of this cell for measurements of the gauge, with the contact force of its data sheet.
    pub fn gauge_dataset(&self) -> Dataset {
        Dataset { contact_force: self.indicators.contact_force(), ..self.dataset() }
    }

    /// Names of the balls.
    pub fn ball_ids(&self) -> Vec<String> {
        self.cell.ball_ids()
    }

    /// Directions from which the balls can be approached.
    pub fn outward(&self) -> &[Unit<Vector3<f64>>] {
        &self.outward
    }

    /// Bodies around the arm while balls are probed.
    pub fn surroundings(&self) -> Surroundings {
        self.bodies.with_artifact()
    }

    /// Visible bodies around the arm: all except the balls, which are part of a dataset.
    pub fn scene(&self) -> Surroundings {
        let Surroundings { mut fixed, carried } = self.surroundings();
        let balls: Vec<String> = self.ball_ids().iter().map(|id| Solid::ball_name(id)).collect();
        fixed.retain(|body| !balls.contains(&body.name));
        Surroundings { fixed, carried }
    }

    /// The same cell with these bodies around the arm, for plans of probings: which of them are removed with the artifact is
    /// not known.
    pub fn with_surroundings(&self, bodies: Surroundings) -> Scenario {
        Scenario { bodies: Bodies::permanent(bodies), ..self.clone() }
    }

    /// Bodies that remain when the artifact has been removed.
    pub fn surroundings_without_artifact(&self) -> Surroundings {
        self.bodies.without_artifact()
    }

    /// The ground truth.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The same cell with its mechanics simulated by this plant.
    pub fn with_plant(&self, plant: PlantKind) -> Scenario {
        Scenario { plant, ..self.clone() }
    }

    /// The same cell with robots sampled by `tilt`, which has a number for every sampled size.
    pub fn tilted(&self, tilt: Tilt) -> Scenario {
        Scenario { truth: self.truth.tilted(tilt), ..self.clone() }
    }

    /// The same cell with another truth; plans made for one are valid for all. Take `truth().keys`, change it, and pass
    /// it here.
    ///
    /// # Errors
    /// When an effect, a parameter or its unit does not exist.
    pub fn with_truth(&self, truth: TruthToml) -> Result<Scenario, FileError> {
        Ok(Scenario { truth: Truth::of(truth, &self.cell, &self.model.own, &self.sources)?, ..self.clone() })
    }
}
