//! The simulated cell at one moment: the true arm, its controller, the TriCal, the balls. Robot and indicators are views of it.

mod views;

use calibench::cell::ManipulatorError;
use calibench::effects::Kind;
use calibench::measure::{CampaignSettings, Dataset, LastMotion};
use calibench::robot::{FramePose, Payload, Pose, RelTool, RelToolError, Robot};
use calibench::units::UM;
use nalgebra::{Point3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::arm::{Arm, Moment};
use crate::cmm::SimulatedCmm;
use crate::contact::{DATUM_RADIUS, FREE_READING};
use crate::controller::{ControllerSpec, Joints};
use crate::gauge::Gauge;
use crate::plunger::{PlungerSpec, PresentedBall};
use crate::random::{Streams, noisy_point};
use crate::scenario::Scenario;
use crate::side::Side;

pub use views::{SharedWorld, SimulatedAttendant, SimulatedIndicator, SimulatedRobot};

/// A wireless indicator answers about eight times a second.
pub const READING_S: f64 = 0.125;

/// It takes a person about so long to place or remove the master ball, s.
pub const HANDLING_S: f64 = 20.0;

/// To screw weight disks on or off, or to take the artifact off the table, s.
pub const REBUILDING_S: f64 = 120.0;

/// A ball further from the TCP than this touches no plunger, m.
const OUT_OF_REACH: f64 = 0.05;

/// The springs and the arm are in balance when the force changes by less than this between two evaluations, N.
const IN_BALANCE: f64 = 1e-9;

/// Evaluations in which that is sought; each shrinks the change by the stiffness of the springs over the arm's, 1e-3.
const MOST_BALANCINGS: usize = 50;

/// The simulated cell.
pub struct World {
    arm: Arm,
    joints: Joints,
    controller: ControllerSpec,
    gauge: Gauge,
    /// Where they truly stand when nothing has moved them.
    balls: Vec<PresentedBall>,
    artifact_is_there: bool,
    payloads: Vec<Payload>,
    payload: usize,
    ball_form: f64,
    master_radius_sigma: f64,
    nominal: Dataset,
    rel_tool: RelTool,
    joint_motion: LastMotion,
    plunger_motion: LastMotion,
    /// Where each plunger hangs up by its side, m, those sides, and where the plungers rest.
    stiction: [f64; 3],
    plunger_sides: [Side; 3],
    plungers_at: Vector3<f64>,
    sample: Option<String>,
    time_s: f64,
    pose: Pose,
    motion: ChaCha8Rng,
    form: ChaCha8Rng,
    master: ChaCha8Rng,
}

fn normal(sigma: f64, rng: &mut ChaCha8Rng) -> f64 {
    sigma * Distribution::<f64>::sample(&StandardNormal, rng)
}

impl World {
    /// The cell of a scenario, its errors drawn from the streams of a trial; the session will take about so many seconds.
    pub fn new(scenario: &Scenario, streams: &Streams, session_s: f64) -> Self {
        let nominal = scenario.dataset();
        let truth = scenario.truth().keys();
        let flaws = scenario.truth().flaws(streams, nominal.robot.joints());
        let mut robot = Robot::clone(&nominal.robot);
        for (link, error) in robot.links.iter_mut().zip(&truth.link_mass_error) {
            link.mass *= 1.0 + error;
        }
        // Certified places are what a CMM made of the true ones; its error is as likely one way as the other.
        let cmm = |sigma_um: f64| SimulatedCmm { centre: sigma_um * UM };
        let mut artifact = streams.stream("artifact");
        let radius_sigma = truth.indicators.ball_diameter_um * UM / 2.0;
        let balls = nominal
            .balls
            .iter()
            .map(|b| PresentedBall {
                centre: cmm(truth.artifact.ball_sigma_um).measure_ball(&b.position, &mut artifact),
                radius: DATUM_RADIUS + normal(radius_sigma, &mut artifact),
            })
            .collect();
        let certified = Vector3::from(nominal.tool.xyz);
        let tool_xyz = cmm(truth.tool.sigma_um).measure_ball(&certified, &mut streams.stream("tool"));
        let tool = FramePose { xyz: tool_xyz.into(), ..nominal.tool };
        let payloads: Vec<Payload> = nominal.payloads.iter().map(|p| scenario.truth().payload(p)).collect();
        let payload = payloads.first().cloned().unwrap_or_else(Payload::none);
        let robot = std::sync::Arc::new(robot);
        let CampaignSettings { joint_motion, plunger_motion, .. } = CampaignSettings::default();
        let mut world = World {
            joints: Joints::new(&robot, &truth.controller, &flaws.hysteresis),
            stiction: flaws.stiction,
            arm: Arm::new(robot.clone(), nominal.clone(), tool, payload, flaws, session_s),
            plunger_sides: [Side::default(); 3],
            controller: truth.controller.clone(),
            gauge: Gauge::draw(&truth.indicators.plungers(), streams),
            balls,
            artifact_is_there: true,
            payloads,
            payload: 0,
            ball_form: truth.indicators.ball_form_um * UM,
            master_radius_sigma: radius_sigma,
            rel_tool: RelTool::new(&nominal.robot),
            nominal,
            joint_motion: LastMotion::new(joint_motion),
            plunger_motion: LastMotion::new(plunger_motion),
            plungers_at: Vector3::repeat(FREE_READING),
            sample: None,
            time_s: 0.0,
            pose: Pose::identity(),
            motion: streams.stream("motion"),
            form: streams.stream("ball form"),
            master: streams.stream("master ball"),
        };
        world.settle();
        world
    }

    /// Force of the three plungers on the tool with a ball centred, tool axes, N: what the gauge's data sheet says.
    pub fn nominal_contact_force(scenario: &Scenario) -> Vector3<f64> {
        let plungers = PlungerSpec { placement: 0.0, ..scenario.truth().keys().indicators.plungers() };
        let gauge = Gauge::draw(&plungers, &Streams { seed: 0, trial: 0 });
        gauge.force_from(Some(&PresentedBall { centre: Vector3::zeros(), radius: DATUM_RADIUS }))
    }

    /// True world position of the TCP, m.
    pub fn tcp(&self) -> Vector3<f64> {
        self.pose.translation.vector
    }

    /// True `world_from_tool`.
    pub fn world_from_tool(&self) -> &Pose {
        &self.pose
    }

    /// Lets the arm come to rest against gravity and the plungers' springs, and the plungers on the ball.
    fn settle(&mut self) {
        let ball = self.balance();
        let at = ball.map_or(Vector3::repeat(FREE_READING), |b| b.centre);
        self.plunger_motion.rest_at(at.as_slice());
        for (k, side) in self.plunger_sides.iter_mut().enumerate() {
            side.moved(at[k] - self.plungers_at[k], self.stiction[k]);
        }
        self.plungers_at = at;
        // A plunger that hangs up shows the ball where it is not.
        let hung = Vector3::from_fn(|k, _| self.stiction[k] * self.plunger_sides[k].value());
        let ball = ball.map(|b| PresentedBall { centre: noisy_point(&(b.centre - hung), self.ball_form, &mut self.form), ..b });
        self.gauge.present(ball);
    }

    /// Seeks the balance of the arm and the plungers' springs; the ball in the tool's frame.
    fn balance(&mut self) -> Option<PresentedBall> {
        let q = self.joints.links();
        let (mut force, mut near, mut ball) = (Vector3::zeros(), None, None);
        // An arm softer than its gauge finds no balance: it is left where it was last, and no centring there succeeds.
        for _ in 0..MOST_BALANCINGS {
            let moment = Moment {
                kind: near.map(Kind::Ball).or((!self.artifact_is_there).then_some(Kind::Point)),
                sample: self.sample.as_deref(),
                commanded: Some(self.joints.commanded()),
                plungers: <[i8; 3]>::try_from(self.plunger_motion.signs()).ok(),
                reading: ball.map(|b: PresentedBall| b.centre),
                time_s: self.time_s,
                temp_c: self.controller.temperature_c(self.time_s),
                approach: Some(self.joint_motion.signs()),
                force,
            };
            self.pose = self.arm.settle(&q, &moment);
            let last = near;
            near = self.nearest_ball();
            ball = near.map(|k| self.ball_in_tool(k));
            let pushed = self.pose.rotation * self.gauge.force_from(ball.as_ref());
            let change = (pushed - force).norm();
            force = pushed;
            if change < IN_BALANCE && near == last {
                break;
            }
        }
        ball
    }

    /// The ball within reach of the plungers, by its place.
    fn nearest_ball(&self) -> Option<usize> {
        let tcp = self.tcp();
        let distance = |k: &usize| (self.balls[*k].centre - tcp).norm();
        let nearest = (0..self.balls.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (self.artifact_is_there && distance(&nearest) < OUT_OF_REACH).then_some(nearest)
    }

    /// A ball where it truly stands now, in the tool's frame.
    fn ball_in_tool(&self, k: usize) -> PresentedBall {
        let PresentedBall { centre, radius } = self.balls[k];
        let centre = self.pose.inverse_transform_point(&Point3::from(centre + self.arm.target_moved())).coords;
        PresentedBall { centre, radius }
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        if let Some(joint) = self.nominal.robot.outside_limits(target, 0.0) {
            return Err(ManipulatorError::JointLimit { joint: joint + 1 });
        }
        self.time_s += self.joints.move_large(target, &mut self.motion);
        self.joint_motion.rest_at(self.joints.commanded());
        self.settle();
        Ok(())
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        let mut target = self.joints.commanded().to_vec();
        let Dataset { robot, base, tool, .. } = &self.nominal;
        self.rel_tool.shift(robot, base, tool, &mut target, offset).map_err(|e| match e {
            RelToolError::JointLimit { joint } => ManipulatorError::JointLimit { joint },
            RelToolError::Singular => ManipulatorError::Unreachable,
        })?;
        self.time_s += self.joints.move_small(&target);
        self.joint_motion.rest_at(self.joints.commanded());
        self.settle();
        Ok(())
    }

    /// What the tracker would see without any noise, the arm standing as it does: where the world that its nests carry has the TCP.
    fn point(&self) -> Vector3<f64> {
        self.tcp() - self.arm.target_moved()
    }
}
