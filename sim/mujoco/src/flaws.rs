//! Flaws as parts of the mechanism: compliant hinges, wheels with friction, stiffening springs, gears with backlash.

use std::io;

use calibench::units::URAD;
use nalgebra::Vector3;

use super::element::{HARDEST, IMPEDANCE, RATE, STEP_S, Xml, element, hardest_ref, joint_name, numbers, write_inertial};
use calibench_sim::scenario::{Bearing, Friction, MujocoToml, Pedestal, Stiffening};

/// The flaws of the mechanism.
#[derive(Debug, Clone)]
pub struct MujocoFlaws {
    keys: MujocoToml,
    /// Stiffness of each gear, N·m/rad.
    stiffness: Vec<f64>,
}

/// Upper bound on the inertia of the arm about a pedestal or a bearing, kg·m²: the rotor's inertia is at least this.
const STRETCHED_OUT: f64 = 20.0;

/// A wheel with dry friction, tied to a joint.
pub struct Wheel {
    /// Its name, also that of its tendon.
    pub name: String,
    /// The joint, from 0.
    pub joint: usize,
    /// Slipping torque, N·m.
    pub torque: f64,
    /// Stiffness of its tie to the joint, N·m/rad.
    pub spring: f64,
}

/// A compliant hinge.
pub struct Hinge {
    /// Its name.
    pub name: String,
    axis: [u8; 2],
    /// Stiffness, N·m/rad.
    pub stiffness: f64,
}

impl Hinge {
    fn new(name: &str, axis: [u8; 2], urad_per_nm: f64) -> Self {
        Hinge { name: name.into(), axis, stiffness: 1.0 / (urad_per_nm * URAD) }
    }

    fn write(&self, xml: &mut Xml) -> io::Result<()> {
        let Hinge { name, axis: [x, y], stiffness } = self;
        let rotor = (stiffness / (RATE * RATE)).max(STRETCHED_OUT);
        element!(xml, "joint", {
            "name" = name, "type" = "hinge", "axis" = format!("{x} {y} 0"), "stiffness" = stiffness, "armature" = rotor,
            "damping" = 2.0 * (stiffness * rotor).sqrt()
        })?;
        Ok(())
    }
}

impl MujocoFlaws {
    /// The flaws of the scenario, for an arm with these gear stiffnesses (N·m/rad).
    pub fn new(keys: &MujocoToml, stiffness: Vec<f64>) -> Self {
        MujocoFlaws { keys: keys.clone(), stiffness }
    }

    /// True if the state at rest depends on the direction from which a joint came.
    pub fn remembers(&self) -> bool {
        !self.keys.friction.is_empty()
    }

    /// Creep rate of wheels that stick, rad/s: MuJoCo's dry friction f yields at `R f / b`, with `R = (1 - d) / I` and
    /// `b = 1 / step` at its hardest setting, and a wheel's inertia is that of its spring at the common rate. This is a
    /// percent of the presliding during settling.
    pub fn creep(&self) -> f64 {
        let yields = |f: &Friction| (1.0 - IMPEDANCE) * RATE * RATE * STEP_S * f.presliding_urad * URAD;
        self.keys.friction.iter().map(yields).fold(0.0, f64::max)
    }

    /// True if the spring of a gear is a tendon with a dead band.
    pub fn has_play(&self, joint: usize) -> bool {
        self.plays().iter().any(|(other, _)| *other == joint)
    }

    /// Joints with backlash, each with half the width of its dead band, rad, realised by the tendon that is the gear's spring.
    pub fn plays(&self) -> Vec<(usize, f64)> {
        self.keys.backlash.iter().map(|b| (b.joint - 1, 0.5 * b.width_urad * URAD)).collect()
    }

    /// Coefficient of the cubic spring of a joint's gear, N·m/rad³: `T = K x + K3 x³` with `K3 = share K³ / T_ref²`
    /// removes `share` of the linear twist at T_ref, to first order.
    pub fn cubic(&self, joint: usize) -> f64 {
        let cubic = |s: &Stiffening| s.share * self.stiffness[joint].powi(3) / (s.at_nm * s.at_nm);
        self.keys.stiffening.iter().find(|s| s.joint == joint + 1).map_or(0.0, cubic)
    }

    /// All compliant hinges.
    pub fn hinges(&self) -> Vec<Hinge> {
        let hinges = self.pedestal().into_iter().flatten();
        hinges.chain(self.keys.bearing.iter().flat_map(Self::bearing)).collect()
    }

    /// The hinges under the base, about its x and its y axis.
    fn pedestal(&self) -> Option<[Hinge; 2]> {
        let pair = |p: &Pedestal| {
            [Hinge::new("pedestal_x", [1, 0], p.x_urad_per_nm), Hinge::new("pedestal_y", [0, 1], p.y_urad_per_nm)]
        };
        self.keys.pedestal.as_ref().map(pair)
    }

    /// The hinges across the axis of a joint, at its origin.
    fn bearing(b: &Bearing) -> [Hinge; 2] {
        let hinge = |axis: &str, xy: [u8; 2]| Hinge::new(&format!("bearing{}_{axis}", b.joint), xy, b.urad_per_nm);
        [hinge("x", [1, 0]), hinge("y", [0, 1])]
    }

    /// Writes the hinges under the base.
    pub fn write_pedestal(&self, xml: &mut Xml) -> io::Result<()> {
        let Some(hinges) = self.pedestal() else { return Ok(()) };
        write_inertial(xml, 0.0, &Vector3::zeros())?;
        hinges.iter().try_for_each(|hinge| hinge.write(xml))
    }

    /// Writes the hinges across the axis of joint `i` (from 0).
    pub fn write_bearing(&self, xml: &mut Xml, i: usize) -> io::Result<()> {
        let Some(bearing) = self.keys.bearing.iter().find(|b| b.joint == i + 1) else { return Ok(()) };
        Self::bearing(bearing).iter().try_for_each(|hinge| hinge.write(xml))
    }

    /// All wheels.
    pub fn wheels(&self) -> Vec<Wheel> {
        let of = |f: &Friction| {
            let joint = f.joint;
            let wheel =
                move |(k, (torque, spring))| Wheel { name: format!("wheel{joint}_{k}"), joint: joint - 1, torque, spring };
            f.wheels().into_iter().enumerate().map(wheel)
        };
        self.keys.friction.iter().flat_map(of).collect()
    }

    /// Writes the wheels: each turns freely, held by its friction.
    pub fn write_wheels(&self, xml: &mut Xml) -> io::Result<()> {
        for Wheel { name, torque, spring, .. } in self.wheels() {
            let inertia = spring / (RATE * RATE);
            element!(xml, "body", { "name" = name }, |xml| {
                write_inertial(xml, 0.0, &Vector3::zeros())?;
                element!(xml, "joint", {
                    "name" = name, "type" = "hinge", "axis" = "0 0 1", "armature" = inertia, "damping" = 2.0 * RATE * inertia,
                    "frictionloss" = torque, "solreffriction" = hardest_ref(), "solimpfriction" = HARDEST
                })?;
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Writes the springs between two rotating parts: a wheel and its joint; a gear with backlash and its motor.
    pub fn write_tendons(&self, xml: &mut Xml) -> io::Result<()> {
        element!(xml, "tendon", {}, |xml| {
            for Wheel { name, joint, spring, .. } in self.wheels() {
                element!(xml, "fixed", { "name" = name, "stiffness" = spring, "springlength" = 0 }, |xml| {
                    element!(xml, "joint", { "joint" = joint_name(joint), "coef" = 1 })?;
                    element!(xml, "joint", { "joint" = name, "coef" = -1 })?;
                    Ok(())
                })?;
            }
            for (joint, half) in self.plays() {
                let (name, stiffness) = (play_name(joint), self.stiffness[joint]);
                element!(xml, "fixed", { "name" = name, "stiffness" = stiffness, "springlength" = numbers(&[-half, half]) }, |xml| {
                    element!(xml, "joint", { "joint" = joint_name(joint), "coef" = 1 })?;
                    Ok(())
                })?;
            }
            Ok(())
        })?;
        Ok(())
    }
}

/// Name of the tendon that is the spring of the gear of joint `i` (from 0), if it has backlash.
pub fn play_name(i: usize) -> String {
    format!("gear{}", i + 1)
}
