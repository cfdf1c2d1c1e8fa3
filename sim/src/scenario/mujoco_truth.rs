//! The keys under `[truth.mujoco]`: flaws simulated by the MuJoCo plant only, as parts of its mechanism.

use calibench::units::URAD;
use serde::Deserialize;

/// Parts of the mechanism that deviate from nominal.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MujocoToml {
    /// A compliant pedestal.
    pub pedestal: Option<Pedestal>,
    /// Compliant bearings.
    #[serde(default)]
    pub bearing: Vec<Bearing>,
    /// Joints with friction.
    #[serde(default)]
    pub friction: Vec<Friction>,
    /// Gears that stiffen with their twist.
    #[serde(default)]
    pub stiffening: Vec<Stiffening>,
    /// Gears with backlash.
    #[serde(default)]
    pub backlash: Vec<Backlash>,
}

/// A compliant pedestal: two hinges with springs at the base's origin.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Pedestal {
    /// Compliance about the base's x axis, urad/(N·m).
    pub x_urad_per_nm: f64,
    /// Compliance about its y axis, urad/(N·m).
    pub y_urad_per_nm: f64,
}

/// A compliant bearing: two hinges with springs across the axis of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Bearing {
    /// Joint, from 1.
    pub joint: usize,
    /// Compliance of each hinge, urad/(N·m).
    pub urad_per_nm: f64,
}

/// Dry friction of a joint: wheels that slip one after the other, each tied to the joint by a spring.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Friction {
    /// Joint, from 1.
    pub joint: usize,
    /// Friction of all three together, N·m.
    pub torque_nm: f64,
    /// Rotation of the joint until the last wheel slips.
    pub presliding_urad: f64,
}

/// A gear that stiffens as it twists: a cubic spring in addition to its linear one.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Stiffening {
    /// Joint, from 1.
    pub joint: usize,
    /// Share of the linear twist that is missing at the torque `at_nm`.
    pub share: f64,
    /// Torque at which this share is missing.
    pub at_nm: f64,
}

/// Play in a gear: its spring is inactive over this width.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// Joint, from 1.
    pub joint: usize,
    /// Width of the backlash, urad.
    pub width_urad: f64,
}

/// A key under `[truth.mujoco]` that does not fit the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfit {
    /// Key below `truth.mujoco`.
    pub key: String,
    /// The problem.
    pub problem: String,
    /// The remedy.
    pub remedy: String,
}

impl MujocoToml {
    /// True if there is no flaw.
    pub fn is_empty(&self) -> bool {
        *self == MujocoToml::default()
    }

    /// Refuses flaws that are impossible for an arm with this number of joints and these compliances (rad/(N·m)).
    ///
    /// # Errors
    /// The first key that does not fit.
    pub fn check(&self, compliance: &[f64]) -> Result<(), Unfit> {
        let joints = compliance.len();
        let unfit = |key: String, problem: String, remedy: &str| Unfit { key, problem, remedy: remedy.into() };
        let positive = |key: String, value: f64| {
            if value > 0.0 { Ok(()) } else { Err(unfit(key, format!("is {value}"), "give a positive number")) }
        };
        let joint = |table: &str, k: usize, joint: usize, needs_gear: bool| {
            let key = format!("{table}[{k}].joint");
            if !(1..=joints).contains(&joint) {
                return Err(unfit(key, format!("is {joint}"), &format!("name a joint from 1 to {joints}")));
            }
            if needs_gear && compliance[joint - 1] <= 0.0 {
                let remedy = format!("give c{joint}_mdeg_per_nm a positive value in truth.effects.joint_compliance");
                return Err(unfit(key, format!("is {joint}, whose gear has no compliance"), &remedy));
            }
            Ok(())
        };
        if let Some(p) = &self.pedestal {
            positive("pedestal.x_urad_per_nm".into(), p.x_urad_per_nm)?;
            positive("pedestal.y_urad_per_nm".into(), p.y_urad_per_nm)?;
        }
        for (k, b) in self.bearing.iter().enumerate() {
            joint("bearing", k, b.joint, false)?;
            positive(format!("bearing[{k}].urad_per_nm"), b.urad_per_nm)?;
        }
        for (k, f) in self.friction.iter().enumerate() {
            joint("friction", k, f.joint, true)?;
            positive(format!("friction[{k}].torque_nm"), f.torque_nm)?;
            positive(format!("friction[{k}].presliding_urad"), f.presliding_urad)?;
        }
        for (k, s) in self.stiffening.iter().enumerate() {
            joint("stiffening", k, s.joint, true)?;
            positive(format!("stiffening[{k}].share"), s.share)?;
            positive(format!("stiffening[{k}].at_nm"), s.at_nm)?;
        }
        for (k, b) in self.backlash.iter().enumerate() {
            joint("backlash", k, b.joint, true)?;
            positive(format!("backlash[{k}].width_urad"), b.width_urad)?;
        }
        let once = |table: &str, joints: Vec<usize>| {
            let twice = joints.iter().enumerate().find(|&(k, j)| joints[..k].contains(j));
            twice.map_or(Ok(()), |(k, j)| {
                Err(unfit(format!("{table}[{k}].joint"), format!("is {j} once more"), "give a joint once"))
            })
        };
        once("bearing", self.bearing.iter().map(|b| b.joint).collect())?;
        once("friction", self.friction.iter().map(|f| f.joint).collect())?;
        once("stiffening", self.stiffening.iter().map(|s| s.joint).collect())?;
        once("backlash", self.backlash.iter().map(|b| b.joint).collect())
    }
}

impl Friction {
    /// Slipping torque (N·m) and spring (N·m/rad) of each of its wheels, which slip at a quarter, a half and the whole
    /// of the presliding.
    pub fn wheels(&self) -> [(f64, f64); 3] {
        let torque = self.torque_nm / 3.0;
        [0.25, 0.5, 1.0].map(|share| (torque, torque / (share * self.presliding_urad * URAD)))
    }
}
