//! A scenario: one question, the cell that answers it, what is truly wrong, and what is expected to come out.

mod bodies;
mod check;
mod design_keys;
mod document;
mod expect;
mod instrument_keys;
mod key;
mod keys;
mod mujoco_truth;
mod precision_keys;
mod sources;
mod sweep_keys;
mod truth;
mod truth_keys;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibench::files::FileError;
use calibench::identify::Model;
use calibench::measure::{Ball, Dataset, Noise};
use calibench::robot::{FramePose, Payload, Robot, Surroundings};
use calibench::units::{ARCSEC, DEG, MM, UM};
use nalgebra::{Unit, Vector3};

use bodies::Bodies;
pub use bodies::ball_body;
pub use design_keys::DesignToml;
pub use document::Document;
pub use expect::{Expectation, Quantity};
pub use instrument_keys::{InstrumentKind, InstrumentToml};
pub use key::Key;
pub use keys::{CentringToml, IndicatorsToml, Order, PlanToml, PlantKind, ScenarioToml, SuiteToml, TRACKER_POOL, TrackerToml};
pub use mujoco_truth::{Backlash, Bearing, Friction, MujocoToml, Pedestal, Stiffening};
pub use precision_keys::{MOST_REPETITIONS, PrecisionToml};
use sources::Sources;
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
    /// What it is to answer.
    pub question: String,
    /// Seed of its plan and its noise.
    pub seed: u64,
    /// Who plays the mechanics of its cell.
    pub plant: PlantKind,
    /// How poses are found and chosen.
    pub plan: PlanToml,
    /// When a ball is centred.
    pub centring: CentringToml,
    /// Where the tracker stands, and how much it measures.
    pub tracker: TrackerToml,
    /// What the identification may use.
    pub model: Model,
    /// What must come out.
    pub expect: Vec<Expectation>,
    /// The precision test of its gauge.
    pub precision: PrecisionToml,
    /// What its gauge's data sheet states.
    pub indicators: IndicatorsToml,
    /// With what its robot is measured.
    pub instrument: InstrumentToml,
    /// Blind trials of the diagnosis.
    pub suite: Option<SuiteToml>,
    /// The points at which a study is made.
    pub sweep: Option<SweepToml>,
    /// What an artifact is to be designed from.
    pub design: Option<DesignToml>,
    cell: Dataset,
    outward: Vec<Unit<Vector3<f64>>>,
    bodies: Bodies,
    truth: Truth,
    sources: Arc<Sources>,
}

/// Reads a scenario and what it extends; every value is checked before anything runs.
///
/// # Errors
/// One error that names file, line, key and remedy.
pub fn load_scenario(path: &Path) -> Result<Scenario, FileError> {
    Document::read(path)?.scenario()
}

/// An empty dataset of the cell: what its owner knows.
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
        },
        ..Dataset::default()
    }
}

impl Scenario {
    /// An error at a key of the scenario, in the file that has it.
    pub fn wrong(&self, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        self.sources.wrong(key, problem, remedy)
    }

    /// That its robot is measured by TriCal, which is all that `verb` can do.
    ///
    /// # Errors
    /// When the scenario names another instrument.
    pub fn expect_trical(&self, verb: &str) -> Result<(), FileError> {
        match self.instrument.kind {
            InstrumentKind::Trical => Ok(()),
            kind => {
                let problem = format!("`{verb}` measures by TriCal alone, not by {}", kind.name());
                Err(self.wrong("instrument.kind", problem, "use `study`, or leave the table out"))
            }
        }
    }

    /// Folder of the scenario file, for paths relative to it.
    pub fn folder(&self) -> PathBuf {
        self.sources.folder()
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.cell.robot
    }

    /// An empty dataset of this cell: what its owner knows.
    pub fn dataset(&self) -> Dataset {
        self.cell.clone()
    }

    /// The same for what the gauge measures: with the force that its data sheet states.
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

    /// What stands around the arm while balls are probed.
    pub fn surroundings(&self) -> Surroundings {
        self.bodies.with_artifact()
    }

    /// What one sees around the arm: the same without the balls, which a dataset has.
    pub fn scene(&self) -> Surroundings {
        let Surroundings { mut fixed, carried } = self.surroundings();
        let balls: Vec<String> = self.ball_ids().iter().map(|id| ball_body(id)).collect();
        fixed.retain(|body| !balls.contains(&body.name));
        Surroundings { fixed, carried }
    }

    /// What is left when the artifact has been taken away.
    pub fn surroundings_without_artifact(&self) -> Surroundings {
        self.bodies.without_artifact()
    }

    /// What is truly so.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The same cell, its mechanics played by that plant.
    pub fn with_plant(&self, plant: PlantKind) -> Scenario {
        Scenario { plant, ..self.clone() }
    }

    /// The same cell with another truth; plans made for one serve for all. Take `truth().keys`, change it, and hand it in.
    ///
    /// # Errors
    /// When an effect, a parameter or its unit does not exist.
    pub fn with_truth(&self, truth: TruthToml) -> Result<Scenario, FileError> {
        Ok(Scenario { truth: Truth::of(truth, &self.cell, &self.model.own, &self.sources)?, ..self.clone() })
    }
}
