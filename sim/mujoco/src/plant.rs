//! The mechanics of a cell in MuJoCo, stepped until it comes to rest.

use calibench::robot::Pose;
use calibench::robot::statics::Payload;
use nalgebra::{Point3, Vector3};

use super::element::{RATE, joint_name};
use super::engine::{Engine, Field, Thing};
use super::flaws::{MujocoFlaws, play_name};
use super::mjcf::{ASIDE, Machine, stiffness};
use calibench_sim::contact::Touch;
use calibench_sim::mechanics::{BallForm, Plant, PlantError, Rest, Stand, within_reach};
use calibench_sim::plunger::{Mechanism, PresentedBall};

/// The cell is at rest when the remaining motion, extrapolated at the common settling rate, is below this, m or rad.
const AT_REST: f64 = 2e-11;
/// Steps between two checks.
const STEPS: usize = 10;
/// Settling is abandoned after this many steps.
const MOST_STEPS: usize = 10_000;
/// Last stretch of a joint's path that is travelled under friction, rad.
const REMEMBERED_WAY: f64 = 2e-3;
/// Number of steps in which it is travelled: 0.01 mrad each.
const REMEMBERED_STEPS: usize = 200;
/// A plunger further than this from its end is in contact, m: contact and limits are compliant by some nanometres.
const TOUCHES: f64 = 1e-7;

/// The mechanics of a cell in MuJoCo.
pub struct MujocoPlant {
    engine: Engine,
    flaws: MujocoFlaws,
    gauge: [Mechanism; 3],
    balls: Vec<PresentedBall>,
    artifact_is_there: bool,
    /// Stiffness of each gear, N·m/rad, and of the compliant hinges, with their indices.
    gears: Vec<(usize, f64)>,
    hinges: Vec<(usize, f64)>,
    slides: [usize; 3],
    wheels: Vec<Rubbing>,
    plays: Vec<(usize, usize, f64)>,
    master: usize,
    payload: usize,
    /// Base and links.
    bodies: Vec<usize>,
    motors: Vec<f64>,
}

/// A wheel with friction: its index, its joint, its slipping torque, N·m.
struct Rubbing {
    place: usize,
    joint: usize,
    torque: f64,
}

impl MujocoPlant {
    /// Loads the plant of a machine.
    ///
    /// # Errors
    /// When Python or MuJoCo is not available, or MuJoCo refuses the machine.
    pub fn of(machine: &Machine) -> Result<Self, PlantError> {
        let engine = Engine::load(&machine.mjcf())?;
        let joints = machine.robot.joints();
        let place = |name: &str| engine.place(Thing::Joint, name);
        let gears: Result<Vec<_>, _> =
            (0..joints).map(|i| Ok((place(&joint_name(i))?, stiffness(machine.compliance[i])))).collect();
        let gears = gears?;
        let hinges: Result<Vec<_>, PlantError> =
            machine.flaws.hinges().iter().map(|hinge| Ok((place(&hinge.name)?, hinge.stiffness))).collect();
        let wheels: Result<Vec<_>, PlantError> = machine
            .flaws
            .wheels()
            .iter()
            .map(|wheel| Ok(Rubbing { place: place(&wheel.name)?, joint: wheel.joint, torque: wheel.torque }))
            .collect();
        let plays: Result<Vec<_>, PlantError> = machine
            .flaws
            .plays()
            .into_iter()
            .map(|(joint, half)| Ok((engine.place(Thing::Tendon, &play_name(joint))?, joint, half)))
            .collect();
        let names = std::iter::once("base".into()).chain((1..=joints).map(|k| format!("link{k}")));
        let bodies: Result<Vec<_>, PlantError> = names.map(|name: String| engine.place(Thing::Body, &name)).collect();
        Ok(MujocoPlant {
            flaws: machine.flaws.clone(),
            gauge: machine.gauge,
            balls: machine.balls.clone(),
            artifact_is_there: true,
            gears,
            hinges: hinges?,
            slides: [place("slide0")?, place("slide1")?, place("slide2")?],
            wheels: wheels?,
            plays: plays?,
            master: engine.place(Thing::Geom, "master")?,
            payload: engine.place(Thing::Body, "payload")?,
            bodies: bodies?,
            motors: vec![0.0; joints],
            engine,
        })
    }

    /// The MuJoCo engine.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Commands every gear to its motor angle.
    fn drive(&self, motors: &[f64]) -> Result<(), PlantError> {
        self.engine.ctrl(|ctrl| ctrl[..motors.len()].copy_from_slice(motors));
        self.engine.change(Field::QposSpring, |spring| {
            for (&(place, _), motor) in self.gears.iter().zip(motors) {
                spring[place] = *motor;
            }
        })?;
        if !self.plays.is_empty() {
            self.engine.change(Field::TendonLengthspring, |length| {
                for &(tendon, joint, half) in &self.plays {
                    length[2 * tendon..][..2].copy_from_slice(&[motors[joint] - half, motors[joint] + half]);
                }
            })?;
        }
        Ok(())
    }

    /// Places the arm near its equilibrium with the motors at `motors`: gears are twisted by their load there. Plungers are
    /// pushed in, so that they come out onto a ball and do not start inside it.
    fn place(&self, motors: &[f64]) -> Result<(), PlantError> {
        self.engine.halt();
        self.engine.qpos(|q| {
            self.gears.iter().zip(motors).for_each(|(&(place, _), motor)| q[place] = *motor);
            self.hinges.iter().for_each(|&(place, _)| q[place] = 0.0);
            for (place, plunger) in self.slides.iter().zip(&self.gauge) {
                q[*place] = plunger.channel.stop_tip - plunger.channel.free_tip;
            }
        });
        self.engine.forward()?;
        let holding = self.engine.holding();
        self.engine.qpos(|q| {
            self.gears.iter().chain(&self.hinges).for_each(|&(place, stiffness)| q[place] -= holding[place] / stiffness);
            self.wheels.iter().for_each(|wheel| q[wheel.place] = q[self.gears[wheel.joint].0]);
        });
        Ok(())
    }

    fn rub(&self, on: bool) -> Result<(), PlantError> {
        self.engine.change(Field::DofFrictionloss, |loss| {
            self.wheels.iter().for_each(|wheel| loss[wheel.place] = if on { wheel.torque } else { 0.0 });
        })
    }

    /// Steps until nothing moves any more.
    fn come_to_rest(&self) -> Result<(), PlantError> {
        let slow = (AT_REST * RATE).max(2.0 * self.flaws.creep());
        for _ in 0..MOST_STEPS / STEPS {
            self.engine.step(STEPS)?;
            // `f64::max` ignores NaN.
            let (fastest, whole) =
                self.engine.qvel(|v| (v.iter().fold(0.0, |most: f64, v| most.max(v.abs())), v.iter().all(|v| v.is_finite())));
            if !whole || fastest > 1e6 {
                return Err(PlantError::Restless { detail: "MuJoCo diverges".into() });
            }
            if fastest < slow {
                return self.engine.kinematics();
            }
        }
        Err(PlantError::Restless { detail: format!("after {MOST_STEPS} steps it still moves") })
    }

    /// Moves the motors a long way to their target.
    fn come_far(&self, from: &[f64], to: &[f64]) -> Result<(), PlantError> {
        if !self.flaws.remembers() {
            self.drive(to)?;
            return self.place(to);
        }
        // The last stretch is travelled under friction; the friction state before it is discarded.
        let way: Vec<f64> = from.iter().zip(to).map(|(from, to)| (to - from).clamp(-REMEMBERED_WAY, REMEMBERED_WAY)).collect();
        let at = |share: f64| -> Vec<f64> { to.iter().zip(&way).map(|(to, way)| to - (1.0 - share) * way).collect() };
        self.drive(&at(0.0))?;
        self.rub(false)?;
        self.place(&at(0.0))?;
        self.come_to_rest()?;
        self.engine.qpos(|q| self.wheels.iter().for_each(|wheel| q[wheel.place] = q[self.gears[wheel.joint].0]));
        self.engine.halt();
        self.rub(true)?;
        for step in 1..=REMEMBERED_STEPS {
            self.drive(&at(step as f64 / REMEMBERED_STEPS as f64))?;
            self.engine.step(1)?;
        }
        Ok(())
    }

    /// Index of the ball within reach of the plungers.
    fn nearest_ball(&self, tcp: &Vector3<f64>) -> Option<usize> {
        if self.artifact_is_there { within_reach(&self.balls, tcp) } else { None }
    }

    /// Contacts of the plungers, from how far they are pushed in.
    fn touches(&self) -> [Touch; 3] {
        let travel = self.engine.qpos(|q| self.slides.map(|place| q[place]));
        std::array::from_fn(|k| {
            let channel = &self.gauge[k].channel;
            let stop = channel.stop_tip - channel.free_tip;
            if travel[k] < TOUCHES {
                Touch::Free
            } else if travel[k] > stop - TOUCHES {
                Touch::Beyond
            } else {
                Touch::At { tip: channel.free_tip + travel[k], on_rim: false, normal: channel.normal.into_inner() }
            }
        })
    }
}

impl Plant for MujocoPlant {
    fn settle(&mut self, stand: &Stand<'_>, form: &mut BallForm) -> Result<Rest, PlantError> {
        if stand.came_far {
            self.come_far(&self.motors, stand.motors)?;
        } else {
            self.engine.halt();
            self.drive(stand.motors)?;
        }
        self.motors.copy_from_slice(stand.motors);
        self.engine.kinematics()?;
        // Each settling touches another spot of the ball, so its form error displaces it differently.
        let before = self.engine.site();
        let away = Vector3::new(0.0, 0.0, ASIDE[2]);
        let artifact_at = match self.nearest_ball(&before.translation.vector) {
            Some(_) => before.rotation * form.touched(&Vector3::zeros()),
            None if self.artifact_is_there => Vector3::zeros(),
            None => away,
        };
        self.engine.move_mocap(&artifact_at);
        self.come_to_rest()?;
        let world_from_tool: Pose = self.engine.site();
        let ball = self.nearest_ball(&world_from_tool.translation.vector).map(|k| {
            let PresentedBall { centre, radius } = self.balls[k];
            PresentedBall { centre: world_from_tool.inverse_transform_point(&Point3::from(centre)).coords, radius }
        });
        Ok(Rest { world_from_tool, ball, touches: self.touches(), target_moved: Vector3::zeros() })
    }

    fn frames(&self) -> Vec<Pose> {
        self.bodies.iter().map(|&body| self.engine.body(body)).collect()
    }

    fn frames_at(&mut self, motors: &[f64]) -> Result<(Vec<Pose>, Pose), PlantError> {
        let rest = self.engine.qpos(|q| q.to_vec());
        self.engine.qpos(|q| self.gears.iter().zip(motors).for_each(|(gear, angle)| q[gear.0] = *angle));
        self.engine.kinematics()?;
        let frames = (self.frames(), self.engine.site());
        self.engine.qpos(|q| q.copy_from_slice(&rest));
        self.engine.kinematics()?;
        Ok(frames)
    }

    fn seat(&mut self, master_radius: Option<f64>) -> Result<[Touch; 3], PlantError> {
        let (at, radius) = match master_radius {
            Some(radius) => ([0.0; 3], radius),
            None => (ASIDE, 1e-3),
        };
        self.engine.change(Field::GeomPos, |pos| pos[3 * self.master..][..3].copy_from_slice(&at))?;
        self.engine.change(Field::GeomSize, |size| size[3 * self.master] = radius)?;
        self.engine.change(Field::GeomRbound, |bound| bound[self.master] = radius)?;
        let motors = self.motors.clone();
        self.place(&motors)?;
        self.come_to_rest()?;
        Ok(self.touches())
    }

    fn mount(&mut self, payload: &Payload) -> Result<(), PlantError> {
        let at = self.payload;
        self.engine.change(Field::BodyMass, |mass| mass[at] = payload.mass)?;
        self.engine.change(Field::BodyIpos, |com| com[3 * at..][..3].copy_from_slice(payload.com.as_slice()))?;
        self.engine.masses_changed()
    }

    fn remove_artifact(&mut self) {
        self.artifact_is_there = false;
    }
}
