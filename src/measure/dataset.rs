//! A set of measurements of one robot, from a real or a simulated cell, in the same form.

pub mod clock_jump;
pub(crate) mod columns;
pub(crate) mod description;
pub mod file;
pub mod joint_limits;
pub(crate) mod limits;
pub(crate) mod samples_file;
pub(crate) mod samples_header;
#[cfg(feature = "schema")]
pub(crate) mod samples_schema;
pub(crate) mod samples_text;

use std::sync::Arc;

use nalgebra::{Rotation3, Vector3};

use crate::robot::statics::{DEFAULT_GRAVITY, Payload};
use crate::robot::{FramePose, Robot};

/// A precision ball of the artifact.
#[derive(Debug, Clone, PartialEq)]
pub struct Ball {
    /// Name.
    pub id: String,
    /// Centre in the world, m; an initial guess if `free`.
    pub position: Vector3<f64>,
    /// One-sigma of each coordinate, m; zero if taken as exact.
    pub sigma: f64,
    /// True if the position is unknown and to be estimated.
    pub free: bool,
}

/// A measured point of the tool beside the TCP: a second reflector, a marker, another socket.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolTarget {
    /// Name.
    pub id: String,
    /// Position relative to the TCP, axes of the tool, m; an initial guess if `free`.
    pub position: Vector3<f64>,
    /// One-sigma of each coordinate, m; zero if taken as exact.
    pub sigma: f64,
    /// True if the position is unknown and to be estimated.
    pub free: bool,
}

/// The parts of the set-up that all sessions of a dataset have in common; by default each session has its own base and tool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Shared {
    /// The robot stayed where it was.
    pub base: bool,
    /// The tool stayed on the flange.
    pub tool: bool,
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
    /// The two balls, by index.
    pub between: [usize; 2],
    /// Distance of their centres, m.
    pub distance: f64,
    /// One-sigma, m.
    pub sigma: f64,
}

/// Known noise of the measurement; `None` if not stated.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Noise {
    /// One-sigma per axis of one centring, m.
    pub ball: Option<f64>,
    /// One-sigma per axis of one tracker point, m; for distances, of the distance.
    pub point: Option<f64>,
    /// One-sigma about each axis of one measured orientation, rad.
    pub orientation: Option<f64>,
    /// One-sigma of the joint angle errors not seen by the encoders, rad (N, or empty).
    pub joint: Vec<f64>,
    /// True if the tool saw the world in samples of poses, as a camera on the hand does: the noise is then that of the world's
    /// origin in the axes of the tool, and an error of the orientation moves where the tool seems to be.
    pub seen_from_tool: bool,
}

/// The measurement of one sample.
#[derive(Debug, Clone, PartialEq)]
pub enum Measured {
    /// The TCP was nulled on a ball.
    Ball {
        /// Ball, by index.
        ball: usize,
        /// Residual indicator readings, m: the ball's centre in the tool frame. `None` if not recorded.
        reading: Option<Vector3<f64>>,
    },
    /// The TCP was measured at this world position, m.
    Point(Vector3<f64>),
    /// The TCP was measured at this distance from an anchor, m.
    Distance {
        /// Anchor, by index.
        anchor: usize,
        /// Distance, m.
        distance: f64,
    },
}

/// The measured orientation of the tool, beside its position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orientation {
    /// Rotation from the tool's to the world's axes, as a rotation vector in the world, rad.
    pub rotation: Vector3<f64>,
    /// One-sigma about each axis, rad, that overrides the dataset's noise.
    pub sigma: Option<f64>,
}

/// Permitted use of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SampleSet {
    /// Identification.
    #[default]
    Fit,
    /// Validation; never used for fitting or selection.
    Validation,
}

/// One measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Unique name.
    pub id: String,
    /// Joint angles as the controller reports them, rad (N).
    pub q: Vec<f64>,
    /// The measurement.
    pub measured: Measured,
    /// The orientation of the tool, if it was measured together with a point.
    pub orientation: Option<Orientation>,
    /// The point of the tool that was measured, by index; `None` for the TCP.
    pub tool_target: Option<usize>,
    /// Permitted use.
    pub set: SampleSet,
    /// Payload, by index.
    pub payload: usize,
    /// Seconds since the session began.
    pub time_s: Option<f64>,
    /// Temperature of the robot, °C.
    pub temp_c: Option<f64>,
    /// Sign of each joint's last motion before the sample (N).
    pub approach: Option<Vec<i8>>,
    /// Sign of each plunger's last motion.
    pub plungers: Option<[i8; 3]>,
    /// Samples of a session with the same name were taken in one posture, whatever their joint angles.
    pub posture: Option<String>,
    /// Samples with the same name are replicates of one target.
    pub repeat: Option<String>,
    /// Samples of one session share one base and one tool.
    pub session: Option<String>,
    /// Commanded joint angles, if `q` are read back, rad (N).
    pub q_commanded: Option<Vec<f64>>,
    /// Commanded position of the point, world frame, m, of samples that measure a point.
    pub commanded: Option<Vector3<f64>>,
    /// Measured joint torques, N·m (N).
    pub tau: Option<Vec<f64>>,
    /// One-sigma that overrides the dataset's noise, m.
    pub sigma: Option<f64>,
    /// Free columns, in the order of [`Dataset::extra_columns`].
    pub extra: Vec<String>,
}

/// Measurements and the setup in which they were made.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// The robot.
    pub robot: Arc<Robot>,
    /// Name of the robot in `dataset.toml`: a built-in, or a path.
    pub robot_reference: String,
    /// Gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// Nominal base in the world.
    pub base: FramePose,
    /// True if this base was found from the rows, and nobody stated it.
    pub base_found: bool,
    /// TCP frame in the last frame, as measured.
    pub tool: FramePose,
    /// One-sigma of each coordinate of the TCP, m; zero if taken as exact.
    pub tool_sigma: f64,
    /// One-sigma of the axes of measured orientations about those of the tool, rad; zero if they are the same.
    pub probe_sigma: f64,
    /// True if the TCP, and the axes of orientations where these are measured, are unknown and to be estimated.
    pub tool_free: bool,
    /// The parts of the set-up that all sessions have in common.
    pub shared: Shared,
    /// Force of the three plungers on the tool when a ball is centred, tool axes, N; zero if not stated.
    pub contact_force: Vector3<f64>,
    /// Payloads; the first is the default.
    pub payloads: Vec<Payload>,
    /// Balls of the artifact.
    pub balls: Vec<Ball>,
    /// Measured points of the tool beside the TCP. They share base, arm and tool.
    pub tool_targets: Vec<ToolTarget>,
    /// Known distances between balls.
    pub ball_distances: Vec<BallDistance>,
    /// Anchors of distance samples.
    pub anchors: Vec<Anchor>,
    /// Known noise.
    pub noise: Noise,
    /// True if the controller's own absolute-accuracy option was on; `None` if not stated.
    pub absolute_accuracy: Option<bool>,
    /// Names of the free columns, with their `extra_` prefix.
    pub extra_columns: Vec<String>,
    /// Provenance as stated by its author: free keys, kept and copied.
    pub provenance: toml::Table,
    /// The measurements.
    pub samples: Vec<Sample>,
    /// SHA-256 of the two files, hexadecimal; empty until written or read.
    pub hash: String,
}

impl Orientation {
    /// Rotation from the tool's to the world's axes.
    pub fn world_from_tool(&self) -> Rotation3<f64> {
        Rotation3::new(self.rotation)
    }
}

/// A dataset with the name by which results speak of it: its folder, or what it is for.
#[derive(Debug, Clone, Copy)]
pub struct NamedDataset<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its measurements.
    pub dataset: &'a Dataset,
}

impl<'a> NamedDataset<'a> {
    /// Calls `dataset` by this name.
    pub fn new(name: &'a str, dataset: &'a Dataset) -> Self {
        NamedDataset { name, dataset }
    }
}

impl Default for Dataset {
    /// An empty dataset with standard gravity.
    fn default() -> Self {
        Dataset {
            robot: Arc::new(Robot {
                name: String::new(),
                source: String::new(),
                links: Vec::new(),
                gear_ratios: Vec::new(),
                ..Robot::default()
            }),
            robot_reference: String::new(),
            gravity: DEFAULT_GRAVITY,
            base: FramePose::default(),
            base_found: false,
            tool: FramePose::default(),
            tool_sigma: 0.0,
            probe_sigma: 0.0,
            tool_free: false,
            shared: Shared::default(),
            contact_force: Vector3::zeros(),
            payloads: Vec::new(),
            balls: Vec::new(),
            tool_targets: Vec::new(),
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
    /// The tool frame with its origin at a measured point of the tool, by index, nominally; at the TCP for `None`.
    ///
    /// ```
    /// use calibench::measure::dataset::{Dataset, ToolTarget};
    /// use calibench::nalgebra::Vector3;
    /// use calibench::robot::FramePose;
    ///
    /// let tool = FramePose { xyz: [0.0, 0.0, 0.1], ..FramePose::default() };
    /// let nest = ToolTarget { id: "r1".into(), position: Vector3::new(0.02, 0.0, 0.0), sigma: 0.0, free: false };
    /// let data = Dataset { tool, tool_targets: vec![nest], ..Dataset::default() };
    /// assert_eq!(data.tool_at(None).xyz, [0.0, 0.0, 0.1]);
    /// assert_eq!(data.tool_at(Some(0)).xyz, [0.02, 0.0, 0.1]);
    /// ```
    pub fn tool_at(&self, tool_target: Option<usize>) -> FramePose {
        match tool_target.and_then(|r| self.tool_targets.get(r)) {
            Some(tool_target) => self.tool.then(&FramePose { xyz: tool_target.position.into(), ..FramePose::default() }),
            None => self.tool,
        }
    }

    /// True if the noise of the position of every pose is stated, so that it is known how its orientation weighs beside it.
    pub fn weighs_orientations(&self) -> bool {
        self.noise.point.is_some() || self.samples.iter().all(|s| s.orientation.is_none() || s.sigma.is_some())
    }

    /// One-sigma about each axis, rad, of the orientation measured by a sample; `None` if it measures none, or it is not stated.
    pub fn sigma_orientation(&self, sample: &Sample) -> Option<f64> {
        sample.orientation.and_then(|o| o.sigma.or(self.noise.orientation))
    }

    /// Names of the balls, in order.
    pub fn ball_ids(&self) -> Vec<String> {
        self.balls.iter().map(|b| b.id.clone()).collect()
    }
}

impl Sample {
    /// The numbers by which a row is recognised: the joints, the ball or anchor by its index, and what was read there; SI.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let (target, read): (Option<usize>, [Option<f64>; 3]) = match &self.measured {
            Measured::Ball { ball, reading } => (Some(*ball), reading.map_or([None; 3], |r| [Some(r.x), Some(r.y), Some(r.z)])),
            Measured::Point(point) => (None, [Some(point.x), Some(point.y), Some(point.z)]),
            Measured::Distance { anchor, distance } => (Some(*anchor), [Some(*distance), None, None]),
        };
        self.q.iter().copied().chain(target.map(|t| t as f64)).chain(read.into_iter().flatten())
    }

    /// Creates a sample with these joints and this measurement, all else unknown.
    pub fn new(id: impl Into<String>, q: Vec<f64>, measured: Measured) -> Self {
        Sample {
            id: id.into(),
            q,
            measured,
            orientation: None,
            tool_target: None,
            set: SampleSet::Fit,
            payload: 0,
            time_s: None,
            temp_c: None,
            approach: None,
            plungers: None,
            posture: None,
            repeat: None,
            session: None,
            q_commanded: None,
            commanded: None,
            tau: None,
            sigma: None,
            extra: Vec::new(),
        }
    }
}
