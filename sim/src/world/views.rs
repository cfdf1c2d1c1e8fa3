//! The procedure's views of the simulated cell: its robot, its indicators, its attendant.

use std::cell::RefCell;
use std::rc::Rc;

use calibench::cell::{Indicator, IndicatorError, Manipulator, ManipulatorError};
use calibench::measure::campaign::LastMotion;
use calibench::measure::campaign::mastering::{Attendant, CalledOff};
use calibench::measure::dataset::Sample;
use nalgebra::Vector3;

use crate::collision::CollisionCheck;
use crate::contact::MASTER_RADIUS;
use crate::planning::retreat;
use crate::random::normal;
use crate::true_arm::TrueArm;

use super::{HANDLING_S, READING_S, REBUILDING_S, World};

/// A world shared by its robot and its indicators.
#[derive(Clone)]
pub struct SharedWorld(pub(super) Rc<RefCell<World>>);

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

    /// Its attendant.
    pub fn attendant(&self) -> SimulatedAttendant {
        SimulatedAttendant(self.clone())
    }

    /// True world position of the TCP, m.
    pub fn tcp(&self) -> Vector3<f64> {
        self.0.borrow().tcp()
    }

    /// Position of the TCP in the world defined by the tracker's nests, m.
    pub fn point(&self) -> Vector3<f64> {
        self.0.borrow().point()
    }

    /// Converts a displacement (world, m) to the true axes of the tool.
    pub fn in_tool(&self, displacement: &Vector3<f64>) -> Vector3<f64> {
        self.0.borrow().world_from_tool().rotation.inverse() * displacement
    }

    /// Lets this time pass, s, for an action of the attendant.
    pub fn wait(&self, duration_s: f64) {
        self.0.borrow_mut().pass(duration_s);
    }

    /// Starts recording the postures of the true arm.
    pub fn note_true_arm(&self) {
        let mut world = self.0.borrow_mut();
        world.true_arm = Some(TrueArm::default());
        world.note_posture();
    }

    /// Returns the recorded postures of the true arm, and stops recording. Empty if nothing was recorded.
    pub fn true_arm(&self) -> TrueArm {
        self.0.borrow_mut().true_arm.take().unwrap_or_default()
    }

    /// Tells the cell the name of the sample being taken.
    pub fn name_sample(&self, id: &str) {
        self.0.borrow_mut().sample = Some(id.to_owned());
    }

    /// Jogs the arm to these joints (rad, N), before it is used for anything else.
    pub fn begin_at(&self, joints: &[f64]) {
        let mut world = self.0.borrow_mut();
        if !world.has_moved {
            world.joints.pass(joints);
            let commanded = world.joints.commanded().to_vec();
            world.joint_motion.rest_at(&commanded);
            world.settle(true);
        }
    }

    /// Disables collision checks from now on: the arm is placed where it is to be measured.
    pub fn put_without_ways(&self) {
        self.0.borrow_mut().collisions = None;
    }

    /// Two bodies that would touch in a motion of the true arm between these joints (rad, N), if any; nothing moves.
    pub fn would_touch(&self, from: &[f64], to: &[f64]) -> Option<[String; 2]> {
        let mut world = self.0.borrow_mut();
        let World { plant, collisions, .. } = &mut *world;
        let mut frames = |motors: &[f64]| plant.frames_at(motors).unwrap_or_default();
        collisions.as_ref()?.first(from, to, &mut frames).map(|collision| collision.between)
    }

    /// Index of the payload on the flange.
    pub fn payload(&self) -> usize {
        self.0.borrow().payload
    }
}

/// The simulated robot.
pub struct SimulatedRobot(SharedWorld);

impl SimulatedRobot {
    /// Completes a sample with the payload, time, temperature and commanded joints of this moment, and with the side
    /// from which each joint came, taken from `motion`.
    #[must_use]
    pub fn stamped(&mut self, motion: &LastMotion, sample: Sample) -> Sample {
        Sample {
            payload: self.0.payload(),
            time_s: Some(self.clock_s()),
            temp_c: self.temperature_c(),
            approach: Some(motion.signs().to_vec()),
            q_commanded: self.commanded(),
            ..sample
        }
    }
}

impl Manipulator for SimulatedRobot {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        let world = self.0.0.borrow();
        world.is_there()?;
        Ok(world.joints.reported().to_vec())
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.0.0.borrow_mut().move_joints(target)
    }

    fn move_along(&mut self, way: &[Vec<f64>]) -> Result<(), ManipulatorError> {
        self.0.0.borrow_mut().move_along(way)
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        self.0.0.borrow_mut().move_in_tool(offset)
    }

    fn clock_s(&mut self) -> f64 {
        self.0.0.borrow().time_s
    }

    fn commanded(&mut self) -> Option<Vec<f64>> {
        let world = self.0.0.borrow();
        world.controller.log_commanded.then(|| world.joints.commanded().to_vec())
    }

    fn temperature_c(&mut self) -> Option<f64> {
        let world = self.0.0.borrow();
        Some(world.controller.temperature_c(world.time_s))
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
        world.pass(READING_S);
        world.gauge.read(self.k)
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        self.world.0.borrow_mut().gauge.preset(self.k, value)
    }
}

/// The attendant: places and removes the master ball, changes the payload, removes the artifact.
pub struct SimulatedAttendant(SharedWorld);

impl SimulatedAttendant {
    /// Mounts the payload with this index; does nothing if it is mounted already.
    pub fn mount(&mut self, payload: usize) {
        let mut world = self.0.0.borrow_mut();
        let world = &mut *world;
        if payload != world.payload && payload < world.payloads.len() {
            world.payload = payload;
            world.pass(REBUILDING_S);
            match world.plant.mount(&world.payloads[payload]) {
                Ok(()) => world.settle(false),
                Err(error) => world.lost = Some(error.to_string()),
            }
        }
    }

    /// Removes the artifact, to make room for the tracker; does nothing if it has been removed.
    pub fn remove_artifact(&mut self) {
        let mut world = self.0.0.borrow_mut();
        if world.artifact_is_there {
            world.artifact_is_there = false;
            world.plant.remove_artifact();
            if world.collisions.is_some() {
                world.collisions = Some(CollisionCheck::new(&world.nominal.robot, &world.without_artifact, -retreat()));
            }
            world.pass(REBUILDING_S);
            world.settle(false);
        }
    }
}

impl Attendant for SimulatedAttendant {
    fn place_master_ball(&mut self) -> Result<(), CalledOff> {
        let mut world = self.0.0.borrow_mut();
        let world = &mut *world;
        let radius_error = normal(world.master_radius_sigma, &mut world.master);
        world.pass(HANDLING_S);
        world.seat(Some(MASTER_RADIUS + radius_error));
        Ok(())
    }

    fn remove_master_ball(&mut self) -> Result<(), CalledOff> {
        let mut world = self.0.0.borrow_mut();
        world.pass(HANDLING_S);
        world.seat(None);
        Ok(())
    }
}
