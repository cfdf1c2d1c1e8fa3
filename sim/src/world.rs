//! The state of the simulated cell: the true arm, its controller, the TriCal, the balls. Robot and indicators are views of it.

mod served;
mod views;

use calibench::cell::ManipulatorError;
use calibench::measure::campaign::{CampaignSettings, LastMotion};
use calibench::measure::dataset::Dataset;
use calibench::robot::Pose;
use calibench::robot::rel_tool::{RelTool, RelToolError};
use calibench::robot::solids::Surroundings;
use calibench::robot::statics::Payload;
use calibench::units::UM;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use crate::collision::{Collision, CollisionCheck};
use crate::contact::FREE_READING;
use crate::controller::{ControllerSpec, Joints};
use crate::gauge::Gauge;
use crate::mechanics::{BallForm, Parts, Plant, PlantError, Rest, Stand};
use crate::planning::retreat;
use crate::plant::plant;
use crate::random::Streams;
use crate::scenario::Scenario;
use crate::true_arm::{TrueArm, TruePosture};

pub use views::{SharedWorld, SimulatedAttendant, SimulatedIndicator, SimulatedRobot};

/// Time per reading, s: a wireless indicator answers about eight times a second.
pub const READING_S: f64 = 0.125;

/// Approximate time for a person to place or remove the master ball, s.
pub const HANDLING_S: f64 = 20.0;

/// Time to mount or remove weight disks, or to take the artifact off the table, s.
pub const REBUILDING_S: f64 = 120.0;

/// The simulated cell.
pub struct World {
    plant: Box<dyn Plant>,
    /// Failure of the plant; nothing more can be measured then.
    lost: Option<String>,
    joints: Joints,
    controller: ControllerSpec,
    gauge: Gauge,
    artifact_is_there: bool,
    payloads: Vec<Payload>,
    payload: usize,
    form: BallForm,
    master_radius_sigma: f64,
    nominal: Dataset,
    rel_tool: RelTool,
    joint_motion: LastMotion,
    plunger_motion: LastMotion,
    sample: Option<String>,
    time_s: f64,
    /// True if the clock is set from outside; otherwise the actions advance it.
    clock_outside: bool,
    pose: Pose,
    target_moved: Vector3<f64>,
    /// Recorded postures, once recording was requested.
    true_arm: Option<TrueArm>,
    motion: ChaCha8Rng,
    master: ChaCha8Rng,
    /// `None` if motions are not checked.
    collisions: Option<CollisionCheck>,
    without_artifact: Surroundings,
    /// Bodies in collision; the arm does not move until this has been dealt with.
    touched: Option<[String; 2]>,
    has_moved: bool,
}

impl World {
    /// The cell of a scenario with errors sampled from the streams of a trial, for a session of about `session_s` seconds.
    ///
    /// # Errors
    /// When the scenario's plant cannot simulate it.
    pub fn new(scenario: &Scenario, streams: &Streams, session_s: f64) -> Result<Self, PlantError> {
        World::altered(scenario, streams, session_s, |_| ())
    }

    /// Builds the cell of a scenario with its parts altered in a way that no scenario provides for.
    ///
    /// # Errors
    /// When the scenario's plant cannot simulate it.
    pub fn altered(
        scenario: &Scenario,
        streams: &Streams,
        session_s: f64,
        alter: impl FnOnce(&mut Parts),
    ) -> Result<Self, PlantError> {
        let nominal = scenario.dataset();
        let truth = scenario.truth().keys();
        let hysteresis = scenario.truth().flaws(streams, nominal.robot.joints()).hysteresis;
        let gauge = Gauge::draw(&truth.indicators.plungers(), streams);
        let mut parts = Parts::of(scenario, streams, &gauge);
        alter(&mut parts);
        let CampaignSettings { joint_motion, plunger_motion, .. } = CampaignSettings::default();
        let mut world = World {
            plant: plant(scenario, streams, &parts, session_s)?,
            lost: None,
            joints: Joints::new(&nominal.robot, &truth.controller, &hysteresis),
            controller: truth.controller.clone(),
            gauge,
            artifact_is_there: true,
            payloads: nominal.payloads.iter().map(|p| scenario.truth().payload(p)).collect(),
            payload: 0,
            form: BallForm { sigma: truth.indicators.ball_form_um * UM, random: streams.stream("ball form") },
            master_radius_sigma: truth.indicators.radius_sigma(),
            rel_tool: RelTool::new(&nominal.robot),
            nominal,
            joint_motion: LastMotion::new(joint_motion),
            plunger_motion: LastMotion::new(plunger_motion),
            sample: None,
            time_s: 0.0,
            clock_outside: false,
            pose: Pose::identity(),
            target_moved: Vector3::zeros(),
            true_arm: None,
            motion: streams.stream("motion"),
            master: streams.stream("master ball"),
            // The trials of a study use the same paths, with arms that differ by a millimetre: the first is checked on
            // behalf of all.
            collisions: (streams.trial == 0)
                .then(|| CollisionCheck::new(scenario.robot(), &scenario.surroundings(), -retreat())),
            without_artifact: scenario.surroundings_without_artifact(),
            touched: None,
            has_moved: false,
        };
        world.settle(true);
        Ok(world)
    }

    /// Lets everything that differs from one measurement to the next be drawn from these streams from now on.
    pub fn renew_noise(&mut self, streams: &Streams) {
        self.gauge.renew_noise(streams);
        self.form.random = streams.stream("ball form");
        self.motion = streams.stream("motion");
        self.master = streams.stream("master ball");
    }

    /// True world position of the TCP, m.
    pub fn tcp(&self) -> Vector3<f64> {
        self.pose.translation.vector
    }

    /// True `world_from_tool`.
    pub fn world_from_tool(&self) -> &Pose {
        &self.pose
    }

    /// Lets the arm settle into equilibrium with gravity and the plungers' springs, and the plungers on the ball.
    fn settle(&mut self, came_far: bool) {
        let stand = Stand {
            motors: &self.joints.links(),
            came_far,
            commanded: self.joints.commanded(),
            approach: self.joint_motion.signs(),
            plungers: <[i8; 3]>::try_from(self.plunger_motion.signs()).ok(),
            sample: self.sample.as_deref(),
            time_s: self.time_s,
            temp_c: self.controller.temperature_c(self.time_s),
        };
        match self.plant.settle(&stand, &mut self.form) {
            Ok(Rest { world_from_tool, ball, touches, target_moved }) => {
                (self.pose, self.target_moved) = (world_from_tool, target_moved);
                let at = ball.map_or(Vector3::repeat(FREE_READING), |b| b.centre);
                self.plunger_motion.rest_at(at.as_slice());
                self.gauge.rest(touches);
                self.note_posture();
            }
            Err(error) => self.lost = Some(error.to_string()),
        }
    }

    fn note_posture(&mut self) {
        if let Some(true_arm) = &mut self.true_arm {
            true_arm.rests(self.time_s, TruePosture { frames: self.plant.frames(), tool: self.pose });
        }
    }

    /// Returns an error if the plant has failed.
    fn is_there(&self) -> Result<(), ManipulatorError> {
        self.lost.clone().map_or(Ok(()), |detail| Err(ManipulatorError::Lost { detail }))
    }

    /// Puts a 1.5-inch ball into the socket, or takes it out.
    fn seat(&mut self, master_radius: Option<f64>) {
        match self.plant.seat(master_radius) {
            Ok(touches) => self.gauge.rest(touches),
            Err(error) => self.lost = Some(error.to_string()),
        }
    }

    fn within_limits(&self, target: &[f64]) -> Result<(), ManipulatorError> {
        let outside = self.nominal.robot.outside_limits(target, 0.0);
        outside.map_or(Ok(()), |joint| Err(ManipulatorError::JointLimit { joint: joint + 1 }))
    }

    /// Checks that the arm reaches these joints (rad) without touching anything; otherwise it stops at the collision.
    fn get_clear(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.within_limits(target)?;
        self.has_moved = true;
        if self.touched.is_none() {
            let World { plant, collisions, joints, lost, .. } = self;
            let mut frames = |motors: &[f64]| match plant.frames_at(motors) {
                Ok(frames) => frames,
                Err(error) => {
                    *lost = Some(error.to_string());
                    Default::default()
                }
            };
            let first = collisions.as_ref().and_then(|check| check.first(joints.commanded(), target, &mut frames));
            if let Some(Collision { between, at }) = first {
                let duration_s = self.joints.pass(&at);
                self.pass(duration_s);
                self.settle(true);
                self.touched = Some(between);
            }
        }
        self.touched.clone().map_or(Ok(()), |between| Err(ManipulatorError::Collision { between }))
    }

    /// Passes all joints of a path (rad) without stopping, except the last, where it comes to rest.
    fn move_along(&mut self, way: &[Vec<f64>]) -> Result<(), ManipulatorError> {
        let Some((target, via)) = way.split_last() else { return Ok(()) };
        for joints in via {
            self.get_clear(joints)?;
            let duration_s = self.joints.pass(joints);
            self.pass(duration_s);
        }
        self.move_joints(target)
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.get_clear(target)?;
        let duration_s = self.joints.move_large(target, &mut self.motion);
        self.pass(duration_s);
        self.joint_motion.rest_at(self.joints.commanded());
        self.settle(true);
        self.is_there()
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        let mut target = self.joints.commanded().to_vec();
        let Dataset { robot, base, tool, .. } = &self.nominal;
        self.rel_tool.shift(robot, base, tool, &mut target, offset).map_err(|e| match e {
            RelToolError::JointLimit { joint } => ManipulatorError::JointLimit { joint },
            RelToolError::Singular => ManipulatorError::Unreachable,
            other => ManipulatorError::Refused { reason: other.to_string() },
        })?;
        self.step_joints(&target)
    }

    /// Makes a small motion to joints within their limits.
    fn step_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        let duration_s = self.joints.move_small(target);
        self.pass(duration_s);
        self.joint_motion.rest_at(self.joints.commanded());
        self.settle(false);
        self.is_there()
    }

    /// Advances the clock by the duration of an action.
    fn pass(&mut self, duration_s: f64) {
        if !self.clock_outside {
            self.time_s += duration_s;
        }
    }

    /// Noise-free tracker point in the arm's present posture: the TCP in the world defined by the nests.
    fn point(&self) -> Vector3<f64> {
        self.tcp() - self.target_moved
    }
}
