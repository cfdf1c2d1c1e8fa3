//! The mechanics of a cell, whatever plays them: the parts they are built of, their inputs and results.

use calibench::measure::dataset::Dataset;
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, Pose, Robot};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use crate::contact::Touch;
use crate::plunger::{Mechanism, PresentedBall};
use crate::random::{Streams, noisy_point};

/// Reasons why a plant cannot be built, or fails.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum PlantError {
    /// The scenario requires something that this plant cannot simulate.
    #[error("{problem}")]
    Unsuited {
        /// The key that requires it.
        key: String,
        /// The problem with it.
        problem: String,
        /// The remedy.
        remedy: String,
    },
    /// The program that simulates it is not available.
    #[error("the {plant} plant is not there: {reason}")]
    Absent {
        /// Its name.
        plant: &'static str,
        /// The missing part, and how to get it.
        reason: String,
    },
    /// It does not come to rest.
    #[error("the simulated mechanics do not come to rest: {detail}")]
    Restless {
        /// The symptom.
        detail: String,
    },
}

/// Parts from which the mechanics of a cell are built: its owner's knowledge, and the ground truth.
#[derive(Debug, Clone)]
pub struct Parts {
    /// The cell as known to its owner.
    pub nominal: Dataset,
    /// The robot with its true masses; its geometry is nominal, deviations come from the truth's effects.
    pub robot: Robot,
    /// True TCP in the last frame.
    pub tool: FramePose,
    /// True load on the flange.
    pub payload: Payload,
    /// True undisturbed positions and true sizes of the balls.
    pub balls: Vec<PresentedBall>,
    /// Moving parts of the three indicators.
    pub gauge: [Mechanism; 3],
}

/// Builds the plant of a cell described by a `C`, with errors sampled from the streams of a trial.
pub type MakePlant<C> = fn(&C, &Streams, &Parts) -> Result<Box<dyn Plant>, PlantError>;

/// State of the cell in which its mechanics are to come to rest.
#[derive(Debug, Clone, Copy)]
pub struct Stand<'a> {
    /// Joint angles at the motor side of the gears, rad.
    pub motors: &'a [f64],
    /// True after a large motion, false after a small correction.
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

/// Rest state of the mechanics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// True `world_from_tool`.
    pub world_from_tool: Pose,
    /// The ball within reach of the plungers, in the tool's frame.
    pub ball: Option<PresentedBall>,
    /// Contacts of the plungers.
    pub touches: [Touch; 3],
    /// Displacement of the ball, or of the measured point, from its place, world, m.
    pub target_moved: Vector3<f64>,
}

/// Form error of a ball: each contact is at another spot of it.
pub struct BallForm {
    /// One-sigma of the surface along each axis, m.
    pub sigma: f64,
    /// Random stream of the form error.
    pub random: ChaCha8Rng,
}

impl BallForm {
    /// The centre as displaced by the form error at this contact, m.
    pub fn touched(&mut self, centre: &Vector3<f64>) -> Vector3<f64> {
        noisy_point(centre, self.sigma, &mut self.random)
    }
}

/// A ball further from the TCP than this touches no plunger, m.
const OUT_OF_REACH: f64 = 0.05;

/// Index of the ball within reach of the plungers of a gauge whose TCP is at `tcp` (world, m).
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

    /// True `world_from_frame` of the base and of every link in the last rest state, the base first (N + 1).
    fn frames(&self) -> Vec<Pose>;

    /// Returns these frames and the true `world_from_tool` with the motors at the given angles (rad), without
    /// deflection. The next `settle` is not affected.
    ///
    /// # Errors
    /// When the posture cannot be evaluated.
    fn frames_at(&mut self, motors: &[f64]) -> Result<(Vec<Pose>, Pose), PlantError>;

    /// Puts a ball of this radius (m) into the socket, or takes it out; returns the contacts of the plungers.
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
