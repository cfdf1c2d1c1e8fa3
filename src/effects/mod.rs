//! What can be wrong with an arm: one file per physical effect, one [`CATALOGUE`].
//!
//! An effect knows its shape, never its size. It says which [`Site`]s it moves, per unit of each of its parameters, in a given
//! [`Situation`]; it is linear in its parameters and free in everything else. The plant holds one set of sizes (the truth), the
//! model another (the estimate).

mod ball;
mod base_frame;
mod bearing_tilt;
mod gravity_backlash;
mod harmonic;
mod joint_compliance;
mod mdh;
mod pedestal;
mod reference_torque;
mod stiffening;
mod tool_frame;

use thiserror::Error;

use crate::robot::{Loads, Payload, Posture, Robot, Site};
use crate::units::Unit;

/// Everything an effect may depend on, at one sample.
///
/// In the model the posture and the loads are those of the nominal arm; in the plant those of the deflected arm at rest.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// The robot as drawn.
    pub robot: &'a Robot,
    /// Joint angles, rad (N).
    pub q: &'a [f64],
    /// The arm in this posture.
    pub posture: &'a Posture,
    /// Gravity's moments and forces in it.
    pub loads: &'a Loads,
    /// What the flange carries.
    pub payload: &'a Payload,
    /// The ball being probed, by its place in the artifact.
    pub ball: Option<usize>,
    /// Seconds since the session began.
    pub time_s: Option<f64>,
    /// Temperature of the robot, °C.
    pub temp_c: Option<f64>,
    /// Sign of each joint's last motion (N).
    pub approach: Option<&'a [i8]>,
}

/// One number of an effect: its name, its unit, and how large it usually is.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterSpec {
    /// Unique among all effects, e.g. `a2`, `c3`, `harmonic1:2.sin`.
    pub name: String,
    /// Unit for people and files.
    pub unit: Unit,
    /// Value on the drawing, SI; the parameter is the deviation from it.
    pub nominal: f64,
    /// One-sigma of a plausible size, SI.
    pub prior: f64,
}

impl ParameterSpec {
    /// A parameter whose drawing value is zero.
    pub fn new(name: impl Into<String>, unit: Unit, prior: f64) -> Self {
        ParameterSpec { name: name.into(), unit, nominal: 0.0, prior }
    }
}

/// A column of the dataset that an effect cannot do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Link masses in the robot's description, or measured torques.
    Masses,
    /// `approach1` ... `approachN`.
    Approach,
    /// `time_s`.
    Time,
    /// `temp_c`.
    Temperature,
    /// Samples of kind `ball`.
    Balls,
}

impl Needs {
    /// In the words of the files.
    pub fn words(self) -> &'static str {
        match self {
            Needs::Masses => "link masses or tau1_nm ...",
            Needs::Approach => "approach1 ...",
            Needs::Time => "time_s",
            Needs::Temperature => "temp_c",
            Needs::Balls => "samples of kind ball",
        }
    }
}

/// Whose property a parameter is: one robot may stand in several sessions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// The arm: shared by all sessions.
    Robot,
    /// The set-up: each session has its own.
    Session,
    /// The artifact: each dataset has its own.
    Artifact,
}

/// One thing that can be wrong, with its parameters.
pub trait Effect: Send + Sync {
    /// As in the catalogue, with its arguments: `harmonic:2:17`.
    fn id(&self) -> &str;

    /// Its parameters.
    fn parameters(&self) -> &[ParameterSpec];

    /// Whose property it is.
    fn owner(&self) -> Owner {
        Owner::Robot
    }

    /// What the data must hold.
    fn needs(&self) -> &[Needs] {
        &[]
    }

    /// Calls `emit(parameter, site, weight)` for every site moved: the site's deviation is the sum of weight x parameter (SI).
    fn terms(&self, at: &Situation<'_>, emit: &mut dyn FnMut(usize, Site, f64));
}

/// What an effect acts on: enough to build it from its id.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// The robot.
    pub robot: &'a Robot,
    /// Names of the balls, in the order of the artifact.
    pub balls: &'a [String],
}

/// Why an id is not an effect.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum EffectError {
    /// No such family.
    #[error("there is no effect '{id}'; `calibench effects` lists what there is")]
    Unknown {
        /// As given.
        id: String,
    },
    /// The part after the colon does not fit.
    #[error("effect '{id}': {problem}")]
    Argument {
        /// As given.
        id: String,
        /// What is wrong with it.
        problem: String,
    },
}

/// Builds an effect from its id, for a robot and an artifact.
pub type Build = fn(&Id<'_>, &Subject<'_>) -> Result<Box<dyn Effect>, EffectError>;

/// An entry of the catalogue.
pub struct Family {
    /// The id before the first colon.
    pub id: &'static str,
    /// What may follow: `""`, `":J"`, `":J:K"`, `":B"`.
    pub arguments: &'static str,
    /// What it is, in a sentence.
    pub what: &'static str,
    /// What it adds, per unit of its parameters.
    pub equation: &'static str,
    /// Builds the effect from its whole id, split at the colons.
    pub build: Build,
}

/// Every effect that plant, model and diagnosis know.
pub const CATALOGUE: &[Family] = &[
    base_frame::FAMILY,
    mdh::FAMILY,
    joint_compliance::FAMILY,
    tool_frame::FAMILY,
    ball::FAMILY,
    harmonic::ONCE,
    harmonic::TWICE,
    harmonic::ANY,
    stiffening::FAMILY,
    gravity_backlash::FAMILY,
    bearing_tilt::FAMILY,
    pedestal::FAMILY,
];

/// Builds the effect of that id for that robot and artifact.
///
/// # Errors
/// When no family has the name, or its arguments do not fit the robot or the artifact.
pub fn build(id: &str, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    let parts: Vec<&str> = id.split(':').collect();
    let family = CATALOGUE.iter().find(|f| f.id == parts[0]).ok_or_else(|| EffectError::Unknown { id: id.into() })?;
    (family.build)(&Id { whole: id, arguments: &parts[1..] }, subject)
}

/// An effect id split at its colons.
#[derive(Debug, Clone, Copy)]
pub struct Id<'a> {
    /// As given.
    pub whole: &'a str,
    /// What follows the family's name.
    pub arguments: &'a [&'a str],
}

impl Id<'_> {
    fn wrong(&self, problem: impl Into<String>) -> EffectError {
        EffectError::Argument { id: self.whole.into(), problem: problem.into() }
    }

    /// That there are at most `most` arguments.
    fn at_most(&self, most: usize) -> Result<(), EffectError> {
        if self.arguments.len() > most {
            return Err(self.wrong(format!("takes at most {most} argument(s)")));
        }
        Ok(())
    }

    /// The joints meant: the one named by the only argument, or all of them. Counted from 0.
    fn joints(&self, subject: &Subject<'_>) -> Result<Vec<usize>, EffectError> {
        self.at_most(1)?;
        if self.arguments.is_empty() { Ok((0..subject.robot.joints()).collect()) } else { Ok(vec![self.joint(0, subject)?]) }
    }

    /// The joint named by argument `k`. Counted from 0.
    fn joint(&self, k: usize, subject: &Subject<'_>) -> Result<usize, EffectError> {
        let n = subject.robot.joints();
        match self.arguments.get(k).and_then(|a| a.parse::<usize>().ok()) {
            Some(j) if (1..=n).contains(&j) => Ok(j - 1),
            _ => Err(self.wrong(format!("names a joint from 1 to {n} after the colon"))),
        }
    }
}
