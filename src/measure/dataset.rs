//! A set of measurements of one robot, from a real cell or a simulated one: nothing downstream can tell the difference.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::robot::{DEFAULT_GRAVITY, FramePose, Payload, Robot};

/// A precision ball of the artifact.
#[derive(Debug, Clone, PartialEq)]
pub struct Ball {
    /// Name.
    pub id: String,
    /// Centre in the world, m; a first guess when `free`.
    pub position: Vector3<f64>,
    /// One-sigma of each coordinate, m; zero when taken as exact.
    pub sigma: f64,
    /// Position unknown, to be estimated.
    pub free: bool,
}

/// A fixed point from which distances are measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Anchor {
    /// Name.
    pub id: String,
    /// Position in the world, m.
    pub position: Vector3<f64>,
}

/// A known distance between two balls.
#[derive(Debug, Clone, PartialEq)]
pub struct BallDistance {
    /// The two balls, by place.
    pub between: [usize; 2],
    /// Distance of their centres, m.
    pub distance: f64,
    /// One-sigma, m.
    pub sigma: f64,
}

/// What is known about the measurement itself; `None` where nothing is stated.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Noise {
    /// One-sigma per axis of one centring, m.
    pub ball: Option<f64>,
    /// One-sigma per axis of one tracker point, m; for distances, of the distance.
    pub point: Option<f64>,
    /// One-sigma of the joint angle that the encoders do not see, rad (N, or empty).
    pub joint: Vec<f64>,
}

/// What one sample measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Measured {
    /// The TCP was nulled on a ball.
    Ball {
        /// Which, by place.
        ball: usize,
        /// Indicator readings left, m: the ball's centre in the tool frame. `None` where not recorded.
        reading: Option<Vector3<f64>>,
    },
    /// The TCP was measured at this world position, m.
    Point(Vector3<f64>),
    /// The TCP was measured at this distance from an anchor, m.
    Distance {
        /// Which, by place.
        anchor: usize,
        /// Distance, m.
        distance: f64,
    },
}

/// What a sample may be used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SampleSet {
    /// Identification.
    #[default]
    Fit,
    /// Judging; never fitted or used to select.
    Validation,
}

/// One measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Unique name.
    pub id: String,
    /// Joint angles as the controller reports them, rad (N).
    pub q: Vec<f64>,
    /// What was measured.
    pub measured: Measured,
    /// What it may be used for.
    pub set: SampleSet,
    /// Payload, by place.
    pub payload: usize,
    /// Seconds since the session began.
    pub time_s: Option<f64>,
    /// Temperature of the robot, °C.
    pub temp_c: Option<f64>,
    /// Sign of each joint's last motion before the sample (N).
    pub approach: Option<Vec<i8>>,
    /// Sign of each plunger's last motion.
    pub plungers: Option<[i8; 3]>,
    /// Samples of the same name are replicates of one target.
    pub repeat: Option<String>,
    /// Samples of one session share one base and one tool.
    pub session: Option<String>,
    /// Commanded joint angles, where `q` are read back, rad (N).
    pub q_commanded: Option<Vec<f64>>,
    /// Measured joint torques, N·m (N).
    pub tau: Option<Vec<f64>>,
    /// One-sigma that overrides the dataset's noise, m.
    pub sigma: Option<f64>,
    /// Free columns, in the order of [`Dataset::extra_columns`].
    pub extra: Vec<String>,
}

/// Measurements and what they were made with.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// The robot.
    pub robot: Arc<Robot>,
    /// How `dataset.toml` names the robot: a built-in, or a path.
    pub robot_reference: String,
    /// Gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// Nominal base in the world.
    pub base: FramePose,
    /// TCP frame in the last frame, as measured.
    pub tool: FramePose,
    /// One-sigma of each coordinate of the TCP, m; zero when taken as exact.
    pub tool_sigma: f64,
    /// TCP unknown, to be estimated.
    pub tool_free: bool,
    /// Force of the three plungers on the tool when a ball is centred, tool axes, N; zero where not stated.
    pub contact_force: Vector3<f64>,
    /// Payloads; the first is the default.
    pub payloads: Vec<Payload>,
    /// Balls of the artifact.
    pub balls: Vec<Ball>,
    /// Known distances between balls.
    pub ball_distances: Vec<BallDistance>,
    /// Anchors of distance samples.
    pub anchors: Vec<Anchor>,
    /// What is known of the noise.
    pub noise: Noise,
    /// Whether the controller's own absolute-accuracy option was on; `None` when not said.
    pub absolute_accuracy: Option<bool>,
    /// Names of the free columns, with their `extra_` prefix.
    pub extra_columns: Vec<String>,
    /// Where it comes from, in the words of whoever took it: free keys, kept and carried through.
    pub provenance: toml::Table,
    /// The measurements.
    pub samples: Vec<Sample>,
    /// SHA-256 of the two files, hexadecimal; empty until written or read.
    pub hash: String,
}

impl Default for Dataset {
    /// No robot, nothing measured; standard gravity.
    fn default() -> Self {
        Dataset {
            robot: Arc::new(Robot {
                name: String::new(),
                source: String::new(),
                links: Vec::new(),
                gear_ratios: Vec::new(),
                solids: Vec::new(),
            }),
            robot_reference: String::new(),
            gravity: DEFAULT_GRAVITY,
            base: FramePose::default(),
            tool: FramePose::default(),
            tool_sigma: 0.0,
            tool_free: false,
            contact_force: Vector3::zeros(),
            payloads: Vec::new(),
            balls: Vec::new(),
            ball_distances: Vec::new(),
            anchors: Vec::new(),
            noise: Noise::default(),
            absolute_accuracy: None,
            extra_columns: Vec::new(),
            provenance: toml::Table::new(),
            samples: Vec::new(),
            hash: String::new(),
        }
    }
}

impl Dataset {
    /// Names of the balls, in order.
    pub fn ball_ids(&self) -> Vec<String> {
        self.balls.iter().map(|b| b.id.clone()).collect()
    }
}

impl Sample {
    /// A sample of these joints and this measurement, nothing else known.
    pub fn new(id: impl Into<String>, q: Vec<f64>, measured: Measured) -> Self {
        Sample {
            id: id.into(),
            q,
            measured,
            set: SampleSet::Fit,
            payload: 0,
            time_s: None,
            temp_c: None,
            approach: None,
            plungers: None,
            repeat: None,
            session: None,
            q_commanded: None,
            tau: None,
            sigma: None,
            extra: Vec::new(),
        }
    }
}
