//! The simulated cell at one moment: the true arm, its controller, the TriCal, the balls. Robot and indicators are views of it.

use std::cell::RefCell;
use std::rc::Rc;

use calibench::cell::{Indicator, IndicatorError, Manipulator, ManipulatorError};
use calibench::measure::{Attendant, CalledOff, Dataset};
use calibench::robot::{FramePose, Payload, Pose, RelTool, RelToolError, Robot};
use calibench::units::UM;
use nalgebra::{Point3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::arm::{Arm, Moment};
use crate::cmm::SimulatedCmm;
use crate::contact::DATUM_RADIUS;
use crate::controller::Joints;
use crate::gauge::Gauge;
use crate::plunger::PresentedBall;
use crate::random::{Streams, noisy_point};
use crate::scenario::Scenario;

/// A wireless indicator answers about eight times a second.
const READING_S: f64 = 0.125;

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
    gauge: Gauge,
    balls: Vec<PresentedBall>,
    ball_form: f64,
    master_radius_sigma: f64,
    nominal: Dataset,
    rel_tool: RelTool,
    approach: Vec<i8>,
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
    /// The cell of a scenario, its errors drawn from the streams of a trial.
    pub fn new(scenario: &Scenario, streams: &Streams) -> Self {
        let nominal = scenario.dataset();
        let truth = &scenario.truth;
        let mut sizes = streams.stream("effects");
        // Checked when the scenario was read.
        let effects = scenario.true_effects(&mut |_, sigma| normal(sigma, &mut sizes)).unwrap_or_default();
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
        let payload = nominal.payloads.first().cloned().unwrap_or_else(Payload::none);
        let robot = std::sync::Arc::new(robot);
        let arm = Arm::new(robot.clone(), nominal.base, tool, payload, nominal.gravity, effects);
        let mut world = World {
            arm,
            joints: Joints::new(&robot, &truth.controller),
            gauge: Gauge::draw(&scenario.plungers(), streams),
            balls,
            ball_form: truth.indicators.ball_form_um * UM,
            master_radius_sigma: radius_sigma,
            rel_tool: RelTool::new(&nominal.robot),
            nominal,
            approach: vec![0; robot.joints()],
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
        let gauge =
            Gauge::draw(&crate::plunger::PlungerSpec { placement: 0.0, ..scenario.plungers() }, &Streams { seed: 0, trial: 0 });
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

    /// Lets the arm come to rest against gravity and the plungers' springs.
    fn settle(&mut self) {
        let q = self.joints.links();
        let mut force = Vector3::zeros();
        // An arm softer than its gauge finds no balance: it is left where it was last, and no centring there succeeds.
        for _ in 0..MOST_BALANCINGS {
            let moment = Moment { time_s: self.time_s, approach: Some(&self.approach), force };
            self.pose = self.arm.settle(&q, &moment);
            let ball = self.ball_in_tool();
            let pushed = self.pose.rotation * self.gauge.force_from(ball.as_ref());
            let change = (pushed - force).norm();
            force = pushed;
            if change < IN_BALANCE {
                break;
            }
        }
        let ball = self.ball_in_tool();
        let ball = ball.map(|b| PresentedBall { centre: noisy_point(&b.centre, self.ball_form, &mut self.form), ..b });
        self.gauge.present(ball);
    }

    fn ball_in_tool(&self) -> Option<PresentedBall> {
        let tcp = self.tcp();
        let nearest = self.balls.iter().min_by(|a, b| (a.centre - tcp).norm().total_cmp(&(b.centre - tcp).norm()))?;
        let centre = self.pose.inverse_transform_point(&Point3::from(nearest.centre)).coords;
        (centre.norm() < OUT_OF_REACH).then_some(PresentedBall { centre, radius: nearest.radius })
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        if let Some(joint) = self.nominal.robot.outside_limits(target, 0.0) {
            return Err(ManipulatorError::JointLimit { joint: joint + 1 });
        }
        self.note_approach(target);
        self.time_s += self.joints.move_large(target, &mut self.motion);
        self.settle();
        Ok(())
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        let mut target = self.joints.reported().to_vec();
        let Dataset { robot, base, tool, .. } = &self.nominal;
        self.rel_tool.shift(robot, base, tool, &mut target, offset).map_err(|e| match e {
            RelToolError::JointLimit { joint } => ManipulatorError::JointLimit { joint },
            RelToolError::Singular => ManipulatorError::Unreachable,
        })?;
        self.note_approach(&target);
        self.time_s += self.joints.move_small(&target);
        self.settle();
        Ok(())
    }

    fn note_approach(&mut self, target: &[f64]) {
        for (sign, (to, from)) in self.approach.iter_mut().zip(target.iter().zip(self.joints.reported())) {
            if to != from {
                *sign = if to > from { 1 } else { -1 };
            }
        }
    }
}

/// A world that its robot and its indicators share.
#[derive(Clone)]
pub struct SharedWorld(Rc<RefCell<World>>);

impl SharedWorld {
    /// Shares a world.
    pub fn new(world: World) -> Self {
        SharedWorld(Rc::new(RefCell::new(world)))
    }

    /// Its robot.
    pub fn robot(&self) -> SimulatedRobot {
        SimulatedRobot(self.clone())
    }

    /// Its three indicators.
    pub fn indicators(&self) -> [SimulatedIndicator; 3] {
        [0, 1, 2].map(|k| SimulatedIndicator { world: self.clone(), k })
    }

    /// Whoever places the master ball in it.
    pub fn attendant(&self) -> SimulatedAttendant {
        SimulatedAttendant(self.clone())
    }

    /// True world position of the TCP, m.
    pub fn tcp(&self) -> Vector3<f64> {
        self.0.borrow().tcp()
    }
}

/// The simulated robot.
pub struct SimulatedRobot(SharedWorld);

impl Manipulator for SimulatedRobot {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        Ok(self.0.0.borrow().joints.reported().to_vec())
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.0.0.borrow_mut().move_joints(target)
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        self.0.0.borrow_mut().move_in_tool(offset)
    }

    fn clock_s(&mut self) -> f64 {
        self.0.0.borrow().time_s
    }
}

/// One simulated indicator.
pub struct SimulatedIndicator {
    world: SharedWorld,
    k: usize,
}

impl Indicator for SimulatedIndicator {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        let mut world = self.world.0.borrow_mut();
        world.time_s += READING_S;
        world.gauge.read(self.k)
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        self.world.0.borrow_mut().gauge.preset(self.k, value)
    }
}

/// Places and removes the master ball.
pub struct SimulatedAttendant(SharedWorld);

/// It takes a person about so long to place or remove the master ball, s.
const HANDLING_S: f64 = 20.0;

impl Attendant for SimulatedAttendant {
    fn place_master_ball(&mut self) -> Result<(), CalledOff> {
        let mut world = self.0.0.borrow_mut();
        let world = &mut *world;
        let radius_error = normal(world.master_radius_sigma, &mut world.master);
        world.time_s += HANDLING_S;
        world.gauge.seat_master(Vector3::zeros(), radius_error);
        Ok(())
    }

    fn remove_master_ball(&mut self) -> Result<(), CalledOff> {
        let mut world = self.0.0.borrow_mut();
        world.time_s += HANDLING_S;
        world.gauge.present(None);
        Ok(())
    }
}
