//! The cell as an MJCF document: everything that MuJoCo is given, and nothing else.
//!
//! Bodies are nested as the MDH rows say, `Rx(alpha) Tx(a) Ry(beta) Tz(d) Rz(theta)` before each hinge about z; gears are the
//! springs of position servos; plungers are disks on slides. Only the state at rest matters here, so inertias and dampings
//! are chosen to reach it soon: rotors ("armatures") are proportional to the stiffness of their gear, so that all joints come
//! to rest at one rate.

use std::io;

use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, Link, MdhLink, Pose, Robot};
use calibench::units::MM;
use nalgebra::{Rotation3, Translation3, UnitQuaternion, Vector3};
use quick_xml::Writer;

use super::element::{HARDEST, RATE, STEP_S, Xml, element, hardest_ref, joint_name, numbers, write_inertial};
use super::flaws::MujocoFlaws;
use super::scenery::Scenery;
use calibench_sim::contact::{DISK_RADIUS, MASTER_RADIUS};
use calibench_sim::plunger::{Mechanism, PresentedBall};

/// Damping ratio (damping over critical damping).
const DAMPING_RATIO: f64 = 1.0;
/// Stiffness of a gear specified without compliance, N·m/rad: 1 N at 1 m turns it by 1e-9 rad.
const RIGID: f64 = 1e9;
/// Inertia of a plunger (as an armature, without weight) per unit of its driving force, kg/N.
const PLUNGER_INERTIA: f64 = 1.0;
/// Speed that the driving force gives a free plunger, m/s: it sets the damping.
const PLUNGER_SPEED: f64 = 0.04;
/// Thickness of the disks, m, the same as in the analytic plant.
const DISK_THICKNESS: f64 = 2.0 * MM;

/// The true cell.
pub struct Machine {
    /// Name of the model.
    pub name: String,
    /// Gravity, world, m/s².
    pub gravity: Vector3<f64>,
    /// Pose of the robot's base.
    pub base: FramePose,
    /// Links as manufactured; limits are not used.
    pub robot: Robot,
    /// Compliance of each gear, rad/(N·m).
    pub compliance: Vec<f64>,
    /// TCP in the last frame.
    pub tool: FramePose,
    /// Load on the flange.
    pub payload: Payload,
    /// True balls: centre, world, and radius.
    pub balls: Vec<PresentedBall>,
    /// Moving parts of the gauge.
    pub gauge: [Mechanism; 3],
    /// Flaws that only this plant can simulate.
    pub flaws: MujocoFlaws,
    /// Scenery, for display only.
    pub scenery: Scenery,
}

impl Machine {
    /// Returns the MJCF document.
    pub fn mjcf(&self) -> String {
        let mut xml = Writer::new_with_indent(Vec::new(), b' ', 1);
        match self.write(&mut xml) {
            Ok(()) => String::from_utf8_lossy(&xml.into_inner()).into_owned(),
            Err(_) => unreachable!("a vector takes all that is written to it"),
        }
    }

    fn write(&self, xml: &mut Xml) -> io::Result<()> {
        element!(xml, "mujoco", { "model" = self.name }, |xml| {
            element!(xml, "compiler", { "angle" = "radian", "autolimits" = "true", "inertiafromgeom" = "false" })?;
            element!(xml, "option", {
                "timestep" = STEP_S, "gravity" = numbers(self.gravity.as_slice()), "integrator" = "implicitfast", "solver" = "Newton",
                "iterations" = 100, "tolerance" = 1e-14
            }, |xml| {
                // A diverging simulation must be detected, not silently reset.
                element!(xml, "flag", { "autoreset" = "disable" })?;
                Ok(())
            })?;
            self.scenery.write_settings(xml)?;
            element!(xml, "worldbody", {}, |xml| {
                self.scenery.write_world(xml)?;
                self.write_artifact(xml)?;
                self.write_base(xml)?;
                self.flaws.write_wheels(xml)
            })?;
            self.write_contacts(xml)?;
            self.flaws.write_tendons(xml)?;
            self.write_actuators(xml)
        })?;
        Ok(())
    }

    /// Writes the balls, on a body that can be taken away, or shifted by a ball's form error.
    fn write_artifact(&self, xml: &mut Xml) -> io::Result<()> {
        element!(xml, "body", { "name" = "artifact", "mocap" = "true" }, |xml| {
            self.scenery.write_artifact(xml)?;
            for (k, ball) in self.balls.iter().enumerate() {
                element!(xml, "geom", {
                    "name" = format!("ball{k}"), "type" = "sphere", "size" = ball.radius, "pos" = numbers(ball.centre.as_slice()),
                    "contype" = 0, "conaffinity" = 0, "material" = "ball"
                })?;
            }
            Ok(())
        })?;
        Ok(())
    }

    fn write_base(&self, xml: &mut Xml) -> io::Result<()> {
        let pose = self.base.pose();
        element!(xml, "body", { "name" = "base", "pos" = position(&pose), "quat" = quaternion(&pose) }, |xml| {
            self.scenery.write_link(xml, 0)?;
            self.flaws.write_pedestal(xml)?;
            self.write_link(xml, 0)
        })?;
        Ok(())
    }

    fn write_link(&self, xml: &mut Xml, i: usize) -> io::Result<()> {
        let Some(Link { mdh, mass, com, .. }) = self.robot.links.get(i) else {
            return self.write_flange(xml);
        };
        let pose = before_hinge(mdh);
        element!(xml, "body", { "name" = format!("link{}", i + 1), "pos" = position(&pose), "quat" = quaternion(&pose) }, |xml| {
            write_inertial(xml, *mass, com)?;
            self.flaws.write_bearing(xml, i)?;
            let gear = self.gear(i);
            element!(xml, "joint", {
                "name" = joint_name(i), "type" = "hinge", "axis" = "0 0 1", "armature" = gear.rotor, "damping" = gear.damping,
                "stiffness" = numbers(&[0.0, 0.0, self.flaws.cubic(i)])
            })?;
            self.scenery.write_link(xml, i + 1)?;
            self.write_link(xml, i + 1)
        })?;
        Ok(())
    }

    fn write_flange(&self, xml: &mut Xml) -> io::Result<()> {
        element!(xml, "body", { "name" = "payload" }, |xml| { write_inertial(xml, self.payload.mass, &self.payload.com) })?;
        let pose = self.tool.pose();
        element!(xml, "body", { "name" = "tool", "pos" = position(&pose), "quat" = quaternion(&pose) }, |xml| {
            element!(xml, "site", { "name" = "tcp", "size" = 0.0005 })?;
            self.scenery.write_tool(xml)?;
            element!(xml, "geom", {
                "name" = "master", "type" = "sphere", "size" = MASTER_RADIUS, "pos" = numbers(&ASIDE), "contype" = 0, "conaffinity" = 0,
                "material" = "ball"
            })?;
            (0..3).try_for_each(|k| self.write_plunger(xml, k))
        })?;
        Ok(())
    }

    fn write_plunger(&self, xml: &mut Xml, k: usize) -> io::Result<()> {
        let channel = self.gauge[k].channel;
        let turned = UnitQuaternion::rotation_between(&Vector3::z(), &channel.normal).unwrap_or_else(UnitQuaternion::identity);
        let foot = channel.foot + channel.along.into_inner() * channel.free_tip;
        let along = turned.inverse() * channel.along.into_inner();
        let pose = Pose::from_parts(Translation3::from(foot), turned.to_rotation_matrix());
        let stop = channel.stop_tip - channel.free_tip;
        element!(xml, "body", { "name" = format!("plunger{k}"), "pos" = position(&pose), "quat" = quaternion(&pose) }, |xml| {
            write_inertial(xml, 0.0, &Vector3::zeros())?;
            element!(xml, "joint", {
                "name" = format!("slide{k}"), "type" = "slide", "axis" = numbers(along.as_slice()), "range" = numbers(&[0.0, stop]),
                "armature" = PLUNGER_INERTIA * self.drive(k), "damping" = self.drive(k) / PLUNGER_SPEED, "solreflimit" = hardest_ref(), "solimplimit" = HARDEST
            })?;
            element!(xml, "geom", {
                "name" = format!("disk{k}"), "type" = "cylinder", "size" = numbers(&[DISK_RADIUS, 0.5 * DISK_THICKNESS]),
                "pos" = numbers(&[0.0, 0.0, 0.5 * DISK_THICKNESS]), "contype" = 0, "conaffinity" = 0, "material" = format!("plunger{k}")
            })?;
            self.scenery.write_plunger(xml, k)
        })?;
        Ok(())
    }

    /// Driving force of plunger `k`, N: its spring, or, if the scenario gives it none, enough to keep it on the ball.
    fn drive(&self, k: usize) -> f64 {
        self.gauge[k].preload.max(LEAST_DRIVE)
    }

    /// Writes the contacts: disks touch balls, nothing else touches anything; collisions on the path are checked when
    /// it is planned.
    fn write_contacts(&self, xml: &mut Xml) -> io::Result<()> {
        element!(xml, "contact", {}, |xml| {
            for k in 0..3 {
                let balls = (0..self.balls.len()).map(|b| format!("ball{b}")).chain(["master".to_owned()]);
                for ball in balls {
                    element!(xml, "pair", {
                        "geom1" = format!("disk{k}"), "geom2" = ball, "condim" = 1, "solref" = hardest_ref(), "solimp" = HARDEST
                    })?;
                }
            }
            Ok(())
        })?;
        Ok(())
    }

    fn write_actuators(&self, xml: &mut Xml) -> io::Result<()> {
        element!(xml, "actuator", {}, |xml| {
            for i in 0..self.robot.joints() {
                let kp = self.gear(i).servo;
                element!(xml, "position", { "name" = format!("servo{}", i + 1), "joint" = joint_name(i), "kp" = kp })?;
            }
            for (k, plunger) in self.gauge.iter().enumerate() {
                element!(xml, "general", {
                    "name" = format!("spring{k}"), "joint" = format!("slide{k}"), "gainprm" = 0, "biastype" = "affine",
                    "biasprm" = numbers(&[-self.drive(k), -plunger.stiffness, 0.0])
                })?;
            }
            Ok(())
        })?;
        Ok(())
    }

    fn gear(&self, i: usize) -> Gear {
        let stiffness = stiffness(self.compliance[i]);
        let rotor = stiffness / (RATE * RATE);
        let servo = if self.flaws.has_play(i) { 0.0 } else { stiffness };
        Gear { servo, rotor, damping: 2.0 * DAMPING_RATIO * RATE * rotor }
    }
}

/// Stiffness of a gear of this compliance, N·m/rad.
pub fn stiffness(compliance: f64) -> f64 {
    if compliance > 1.0 / RIGID { 1.0 / compliance } else { RIGID }
}

/// A gear: its spring, N·m/rad, as the servo realises it; its rotor, kg·m²; its damping, N·m·s/rad.
struct Gear {
    servo: f64,
    rotor: f64,
    damping: f64,
}

/// Parking position of the master ball, in the tool's frame, m: out of the way of everything.
pub const ASIDE: [f64; 3] = [0.0, 0.0, 50.0];
/// Least driving force of a plunger, N: without a spring it would not follow its ball.
const LEAST_DRIVE: f64 = 1e-3;

/// Pose of a link's body in the previous one, its joint at zero: `Rx(alpha) Tx(a) Ry(beta) Tz(d) Rz(theta)`.
fn before_hinge(mdh: &MdhLink) -> Pose {
    let rx = Rotation3::from_axis_angle(&Vector3::x_axis(), mdh.alpha);
    let ry = Rotation3::from_axis_angle(&Vector3::y_axis(), mdh.beta);
    let rz = Rotation3::from_axis_angle(&Vector3::z_axis(), mdh.theta);
    let at = rx * Vector3::new(mdh.a, 0.0, 0.0) + rx * (ry * Vector3::new(0.0, 0.0, mdh.d));
    Pose::from_parts(Translation3::from(at), rx * ry * rz)
}

fn position(pose: &Pose) -> String {
    numbers(pose.translation.vector.as_slice())
}

fn quaternion(pose: &Pose) -> String {
    let q = UnitQuaternion::from_rotation_matrix(&pose.rotation);
    numbers(&[q.w, q.i, q.j, q.k])
}
