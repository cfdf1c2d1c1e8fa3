//! The quantities on which an effect may depend, at one sample.

use nalgebra::Vector3;

use crate::robot::kinematics::PostureView;
use crate::robot::statics::{DEFAULT_GRAVITY, Loads, Payload};
use crate::robot::{FramePose, Robot};

/// The quantity measured at a sample, as in the column `kind`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The TCP is nulled on a ball, given by its index in the artifact.
    Ball(usize),
    /// The position of the TCP is measured.
    Point,
    /// The distance of the TCP from an anchor is measured.
    Distance,
}

/// The artifact as a whole, as certified.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArtifactShape {
    /// Mean of the balls' centres, world, m.
    pub centroid: Vector3<f64>,
    /// Heights of the lowest and the highest ball, world z, m.
    pub heights: [f64; 2],
}

impl ArtifactShape {
    /// The shape of balls at these positions (world, m).
    pub fn of(balls: &[Vector3<f64>]) -> Self {
        let centroid = balls.iter().sum::<Vector3<f64>>() / balls.len().max(1) as f64;
        let widen = |[low, high]: [f64; 2], b: &Vector3<f64>| [low.min(b.z), high.max(b.z)];
        ArtifactShape { centroid, heights: balls.iter().fold([f64::INFINITY, f64::NEG_INFINITY], widen) }
    }

    /// Height above the lowest ball, as a share of that of the highest: 0 to 1, and 0 if all balls are level.
    ///
    /// ```
    /// use calibench::effects::situation::ArtifactShape;
    /// use calibench::nalgebra::Vector3;
    ///
    /// let shape = ArtifactShape::of(&[Vector3::new(0.5, 0.0, 1.0), Vector3::new(0.7, 0.0, 3.0)]);
    /// assert_eq!(shape.share_of_height(1.5), 0.25);
    /// ```
    pub fn share_of_height(&self, z: f64) -> f64 {
        let [low, high] = self.heights;
        if high > low { (z - low) / (high - low) } else { 0.0 }
    }
}

/// The quantities on which an effect may depend, at one sample.
///
/// In the model the posture and the loads are those of the arm as identified so far; in the plant those of the deflected
/// arm at rest. Unknown quantities are `None`, and effects that depend on them then move nothing.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// The nominal robot.
    pub robot: &'a Robot,
    /// Joint angles, rad (N).
    pub q: &'a [f64],
    /// The posture of the arm.
    pub posture: &'a dyn PostureView,
    /// Moments and forces of gravity in that posture.
    pub loads: &'a Loads,
    /// The payload on the flange.
    pub payload: &'a Payload,
    /// Gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// TCP frame in the last frame, as certified; its axes are those of the indicators.
    pub tool: FramePose,
    /// Compliance of each joint, rad/(N·m): the model's present value, or the ground truth in the plant; empty if there is
    /// none.
    pub compliance: &'a [f64],
    /// Name of the sample.
    pub sample: Option<&'a str>,
    /// Name of the measured point of the tool; `None` for the TCP.
    pub tool_target: Option<&'a str>,
    /// The quantity measured.
    pub kind: Option<Kind>,
    /// Certified position of the ball, or the measured point, world, m.
    pub target: Option<Vector3<f64>>,
    /// The artifact.
    pub artifact: Option<ArtifactShape>,
    /// Residual indicator readings, tool axes, m.
    pub reading: Option<Vector3<f64>>,
    /// Sign of each plunger's last motion.
    pub plungers: Option<[i8; 3]>,
    /// Commanded joint angles, if `q` are reported ones, rad (N).
    pub q_commanded: Option<&'a [f64]>,
    /// Joint angles of the previous sample, in the order of measurement within the session, rad (N).
    pub q_before: Option<&'a [f64]>,
    /// How far each joint is turned against a hose that follows it with play, as a share of the play, -1 to 1 (N).
    pub hose: Option<&'a [f64]>,
    /// Sign of each joint's last motion (N).
    pub approach: Option<&'a [i8]>,
    /// Seconds since the session began.
    pub time_s: Option<f64>,
    /// Length of the session, s.
    pub duration_s: Option<f64>,
    /// Temperature of the robot, °C.
    pub temp_c: Option<f64>,
}

impl<'a> Situation<'a> {
    /// An arm at rest under standard gravity with no measurement and nothing else known.
    #[inline(always)]
    pub fn at_rest(
        robot: &'a Robot,
        q: &'a [f64],
        posture: &'a dyn PostureView,
        loads: &'a Loads,
        payload: &'a Payload,
    ) -> Self {
        Situation {
            robot,
            q,
            posture,
            loads,
            payload,
            gravity: DEFAULT_GRAVITY,
            tool: FramePose::default(),
            compliance: &[],
            sample: None,
            tool_target: None,
            kind: None,
            target: None,
            artifact: None,
            reading: None,
            plungers: None,
            q_commanded: None,
            q_before: None,
            hose: None,
            approach: None,
            time_s: None,
            duration_s: None,
            temp_c: None,
        }
    }

    /// The ball being probed, by its index in the artifact.
    pub fn ball(&self) -> Option<usize> {
        match self.kind {
            Some(Kind::Ball(ball)) => Some(ball),
            _ => None,
        }
    }

    /// Direction of gravity in the axes of the last frame; zero without gravity.
    pub fn gravity_in_last_frame(&self) -> Vector3<f64> {
        let down = self.gravity.try_normalize(0.0).unwrap_or_default();
        self.posture.frame(self.q.len()).components(&down)
    }

    /// Time as a share of the session, 0 to 1: its coefficient is the amount accumulated at the end of the session.
    pub fn share_of_session(&self) -> Option<f64> {
        let (time, duration) = (self.time_s?, self.duration_s?);
        Some(if duration > 0.0 { (time / duration).min(1.0) } else { 0.0 })
    }

    /// True if the sample was taken later than `time` (s) into the session.
    pub(super) fn is_after(&self, time: f64) -> bool {
        self.time_s.is_some_and(|t| t > time)
    }

    /// Axis `i` (counted from 0) of the tool, along which indicator `i` measures, axes of the last frame.
    pub(super) fn tool_axis(&self, i: usize) -> Vector3<f64> {
        let axes = FramePose { xyz: [0.0; 3], ..self.tool }.pose().rotation;
        axes.matrix().column(i).into_owned()
    }
}
