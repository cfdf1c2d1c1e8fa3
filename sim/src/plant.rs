//! The mechanics of a cell: where arm, balls and plungers come to rest when the motors stand at given angles.
//!
//! The world around it is the same for every plant: the robot's controller, the counters of the indicators, the clock, the tracker.

mod analytic;

use calibench::measure::Dataset;
use calibench::robot::{FramePose, Payload, Pose, Robot};
use calibench::units::UM;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use crate::cmm::SimulatedCmm;
use crate::contact::{DATUM_RADIUS, Touch};
use crate::gauge::Gauge;
use crate::plunger::{Mechanism, PresentedBall};
use crate::random::{Streams, noisy_point, normal};
use crate::scenario::{PlantKind, Scenario};

pub use analytic::AnalyticPlant;

/// Why a plant cannot be built, or is at a loss.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum PlantError {
    /// The scenario asks for what this plant is not made of.
    #[error("{problem}")]
    Unsuited {
        /// The key that asks.
        key: String,
        /// What is wrong with it here.
        problem: String,
        /// What to do.
        remedy: String,
    },
    /// What plays it is not there.
    #[error("the {plant} plant is not there: {reason}")]
    Absent {
        /// Its name.
        plant: &'static str,
        /// What is missing, and how to get it.
        reason: String,
    },
    /// It does not come to rest.
    #[error("the simulated mechanics do not come to rest: {detail}")]
    Restless {
        /// What was seen.
        detail: String,
    },
}

/// What the mechanics of a cell are built from: its owner's knowledge, and what is truly there.
#[derive(Debug, Clone)]
pub struct Parts {
    /// What its owner knows.
    pub nominal: Dataset,
    /// The robot with its true masses; its geometry is as drawn, deviations come from the truth's effects.
    pub robot: Robot,
    /// True TCP in the last frame.
    pub tool: FramePose,
    /// What is truly on the flange.
    pub payload: Payload,
    /// Where the balls truly stand when nothing has moved them, and how large they are.
    pub balls: Vec<PresentedBall>,
    /// What moves in the three indicators.
    pub gauge: [Mechanism; 3],
}

impl Parts {
    /// Those of a scenario, with `gauge` on the flange, their errors drawn from the streams of a trial.
    pub fn of(scenario: &Scenario, streams: &Streams, gauge: &Gauge) -> Self {
        let nominal = scenario.dataset();
        let truth = scenario.truth().keys();
        let mut robot = Robot::clone(&nominal.robot);
        for (link, error) in robot.links.iter_mut().zip(&truth.link_mass_error) {
            link.mass *= 1.0 + error;
        }
        // Certified places are what a CMM made of the true ones; its error is as likely one way as the other.
        let cmm = |sigma_um: f64| SimulatedCmm { centre: sigma_um * UM };
        let mut artifact = streams.stream("artifact");
        let balls = nominal
            .balls
            .iter()
            .map(|b| PresentedBall {
                centre: cmm(truth.artifact.ball_sigma_um).measure_ball(&b.position, &mut artifact),
                radius: DATUM_RADIUS + normal(truth.indicators.radius_sigma(), &mut artifact),
            })
            .collect();
        let certified = Vector3::from(nominal.tool.xyz);
        let tool_xyz = cmm(truth.tool.sigma_um).measure_ball(&certified, &mut streams.stream("tool"));
        Parts {
            robot,
            tool: FramePose { xyz: tool_xyz.into(), ..nominal.tool },
            payload: nominal.payloads.first().map_or_else(Payload::none, |p| scenario.truth().payload(p)),
            balls,
            gauge: gauge.mechanisms(),
            nominal,
        }
    }
}

/// The plant that a scenario asks for; the session will take about so many seconds.
///
/// # Errors
/// When that plant cannot play the scenario, or is not there.
pub fn plant(scenario: &Scenario, streams: &Streams, parts: &Parts, session_s: f64) -> Result<Box<dyn Plant>, PlantError> {
    match scenario.plant {
        PlantKind::Analytic if scenario.truth().keys().mujoco.is_empty() => {
            let flaws = scenario.truth().flaws(streams, parts.robot.joints());
            Ok(Box::new(AnalyticPlant::new(parts, flaws, session_s)))
        }
        PlantKind::Analytic => Err(PlantError::Unsuited {
            key: "truth.mujoco".into(),
            problem: "is what only the MuJoCo plant can play".into(),
            remedy: "run it with --plant mujoco, or write plant = \"mujoco\"".into(),
        }),
        PlantKind::Mujoco => mujoco(scenario, streams, parts),
    }
}

#[cfg(feature = "mujoco")]
fn mujoco(scenario: &Scenario, streams: &Streams, parts: &Parts) -> Result<Box<dyn Plant>, PlantError> {
    let machine = crate::mujoco::machine(scenario, streams, parts)?;
    Ok(Box::new(crate::mujoco::MujocoPlant::of(&machine)?))
}

#[cfg(not(feature = "mujoco"))]
fn mujoco(_: &Scenario, _: &Streams, _: &Parts) -> Result<Box<dyn Plant>, PlantError> {
    let reason = "this program was built without it; run sim/setup.sh, then build with --features mujoco".into();
    Err(PlantError::Absent { plant: "mujoco", reason })
}

/// How the cell stands when its mechanics are to come to rest.
#[derive(Debug, Clone, Copy)]
pub struct Stand<'a> {
    /// Joint angles at which the motors' ends of the gears stand, rad.
    pub motors: &'a [f64],
    /// Whether they came a long way, or were only shifted by a small correction.
    pub came_far: bool,
    /// Joint angles that the controller commands, rad.
    pub commanded: &'a [f64],
    /// Sign of each joint's last motion.
    pub approach: &'a [i8],
    /// Sign of each plunger's last motion.
    pub plungers: Option<[i8; 3]>,
    /// Name of the sample.
    pub sample: Option<&'a str>,
    /// Seconds since the session began.
    pub time_s: f64,
    /// Temperature of the robot, °C.
    pub temp_c: f64,
}

/// How the mechanics came to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// True `world_from_tool`.
    pub world_from_tool: Pose,
    /// The ball within reach of the plungers, in the tool's frame.
    pub ball: Option<PresentedBall>,
    /// What the plungers touch.
    pub touches: [Touch; 3],
    /// How far the ball, or the point as measured, stands from its place, world, m.
    pub target_moved: Vector3<f64>,
}

/// No ball is a perfect sphere: each touch is on another place of it.
pub struct BallForm {
    /// One-sigma of the surface along each axis, m.
    pub sigma: f64,
    /// Its stream.
    pub random: ChaCha8Rng,
}

impl BallForm {
    /// A centre as it is touched this time, m.
    pub fn touched(&mut self, centre: &Vector3<f64>) -> Vector3<f64> {
        noisy_point(centre, self.sigma, &mut self.random)
    }
}

/// A ball further from the TCP than this touches no plunger, m.
const OUT_OF_REACH: f64 = 0.05;

/// The ball within reach of the plungers of a gauge whose TCP is at `tcp` (world, m), by its place.
pub fn within_reach(balls: &[PresentedBall], tcp: &Vector3<f64>) -> Option<usize> {
    let squares = balls.iter().map(|ball| (ball.centre - tcp).norm_squared());
    let (nearest, square) = squares.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (square < OUT_OF_REACH * OUT_OF_REACH).then_some(nearest)
}

/// The mechanics of a cell.
pub trait Plant {
    /// Lets everything come to rest.
    ///
    /// # Errors
    /// When it does not.
    fn settle(&mut self, stand: &Stand<'_>, form: &mut BallForm) -> Result<Rest, PlantError>;

    /// True `world_from_frame` of the base and of every link as they came to rest last, the base first (N + 1).
    fn frames(&self) -> Vec<Pose>;

    /// The same with the motors at these angles (rad), nothing having given way yet, and true `world_from_tool`. The arm is left where it
    /// came to rest.
    ///
    /// # Errors
    /// When the posture cannot be evaluated.
    fn frames_at(&mut self, motors: &[f64]) -> Result<(Vec<Pose>, Pose), PlantError>;

    /// Puts a ball of that radius (m) into the socket, or takes it out; what the plungers touch then.
    ///
    /// # Errors
    /// When they do not come to rest.
    fn seat(&mut self, master_radius: Option<f64>) -> Result<[Touch; 3], PlantError>;

    /// Puts another payload on the flange.
    ///
    /// # Errors
    /// When it cannot be mounted.
    fn mount(&mut self, payload: &Payload) -> Result<(), PlantError>;

    /// Takes the artifact off the table.
    fn remove_artifact(&mut self);
}
