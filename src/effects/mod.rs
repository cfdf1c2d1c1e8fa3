//! What can be wrong with an arm, its gauge, its artifact or its set-up: one file per physical effect, one [`CATALOGUE`].
//!
//! An effect knows its shape, never its size. It says which [`Site`]s it moves, per unit of each of its parameters, in a given
//! [`Situation`]; it is linear in its parameters and free in everything else. The plant holds one set of sizes (the truth), the
//! model another (the estimate). A user's own effects ([`OwnEffect`]) are written as expressions and are not told apart from these.

mod artifact_sag;
mod artifact_scale;
mod artifact_step;
mod ball;
mod ball_step;
mod base_drift;
mod base_frame;
mod base_step;
mod bearing_tilt;
mod cross_compliance;
mod error_curve;
mod expression;
mod facts;
mod family;
mod gauge_gain;
mod gauge_tilt;
mod gauge_zero;
mod gravity_backlash;
mod gravity_direction;
mod harmonic;
mod hysteresis;
mod id;
mod joint_compliance;
mod joint_scale;
mod joint_source;
mod joint_step;
mod link_bending;
mod link_mass;
mod lumped_gravity;
mod mdh;
mod outlier;
mod own;
mod payload_com;
mod payload_mass;
mod payload_moment;
mod pedestal;
mod product;
mod reference_torque;
mod registry;
mod shape;
mod situation;
mod stiction;
mod stiffening;
mod thermal_growth;
mod thermal_joint;
mod through_compliance;
mod tool_frame;
mod tool_step;
mod tracker_registration;
mod unsettled;
mod wrist_coupling;

use thiserror::Error;

pub use facts::{Follows, LinearRange, Meaning, Offered, Period, Physical, Role, Stray, Unphysical};
pub use family::{Build, CATALOGUE, Family, Origin, Scan};
pub use id::EffectId;
pub use outlier::{set_aside_by, setting_aside};
pub use own::{OwnEffect, OwnEffectError, OwnTerm};
pub use registry::{Registry, family, ids};
pub use situation::{ArtifactShape, Kind, Situation};

use crate::robot::{Robot, Site};
use crate::units::Unit;

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

    /// Three of them, `NAME.x` to `NAME.z`.
    fn xyz(name: &str, unit: Unit, prior: f64) -> Vec<Self> {
        ["x", "y", "z"].iter().map(|axis| ParameterSpec::new(format!("{name}.{axis}"), unit, prior)).collect()
    }
}

/// What an effect cannot do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Joint torques: link masses in the robot's description, or `tau1_nm` ... `tauN_nm`.
    Torques,
    /// Link masses in the robot's description.
    Masses,
    /// `joint_compliance` in the model, and torques from masses: a load that is not as entered acts through it.
    Compliance,
    /// `approach1` ... `approachN`.
    Approach,
    /// `plunger1` ... `plunger3`.
    Plungers,
    /// `r1_um` ... `r3_um`.
    Readings,
    /// `qcmd1_deg` ... `qcmdN_deg`.
    Commanded,
    /// `time_s`.
    Time,
    /// `temp_c`.
    Temperature,
    /// Samples of kind `ball`.
    Balls,
    /// Samples of kind `point`.
    Points,
}

impl Needs {
    /// In the words of the files.
    pub fn words(self) -> &'static str {
        match self {
            Needs::Torques => "link masses or tau1_nm ...",
            Needs::Masses => "link masses",
            Needs::Compliance => "joint_compliance in the model",
            Needs::Approach => "approach1 ...",
            Needs::Plungers => "plunger1 ...",
            Needs::Readings => "r1_um ...",
            Needs::Commanded => "qcmd1_deg ...",
            Needs::Time => "time_s",
            Needs::Temperature => "temp_c",
            Needs::Balls => "samples of kind ball",
            Needs::Points => "samples of kind point",
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

/// Takes a parameter (by place among those of its effect), a site, and how far one SI unit of the parameter moves it, SI.
pub type Emit<'e> = dyn FnMut(usize, Site, f64) + 'e;

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

    /// Its terms (parameter, site, weight), none of them zero, where they are the same in every situation: they need not be asked for.
    fn constant(&self) -> Option<&[(usize, Site, f64)]> {
        None
    }

    /// Calls `emit(parameter, site, weight)` for every site moved: the site's deviation is the sum of weight x parameter (SI).
    fn terms(&self, at: &Situation<'_>, emit: &mut Emit<'_>);

    /// The user's expression by which a parameter moves a site; `None` for what is not written by a user.
    fn expression(&self, _parameter: usize, _site: Site) -> Option<&str> {
        None
    }
}

/// What an effect acts on: enough to build it from its id.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// The robot.
    pub robot: &'a Robot,
    /// Names of the balls, in the order of the artifact.
    pub balls: &'a [String],
    /// The user's own effects.
    pub own: &'a [OwnEffect],
    /// The families that there are.
    pub registry: &'a Registry,
    /// Names of the samples, where they are known: an effect of one that is not there is then refused.
    pub samples: Option<&'a [String]>,
}

impl<'a> Subject<'a> {
    /// A robot and an artifact, with the families of the catalogue and without effects of the user's own.
    pub fn new(robot: &'a Robot, balls: &'a [String]) -> Self {
        Subject { robot, balls, own: &[], registry: Registry::catalogue(), samples: None }
    }
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
    /// A family cannot be added under a name that is taken.
    #[error("there is a family '{id}' already; give the new one another id")]
    Taken {
        /// The id of both.
        id: String,
    },
    /// An effect of the user's own is not well formed.
    #[error("effect '{id}': {error}")]
    Own {
        /// Its name.
        id: String,
        /// What is wrong with it.
        error: OwnEffectError,
    },
}

/// Builds the effect of that id for that robot and artifact.
///
/// # Errors
/// When no family and no effect of the user's own has the name, or its arguments do not fit the robot or the artifact.
pub fn build(id: &str, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    if let Some(own) = subject.own.iter().find(|e| e.name == id) {
        return own.build(subject).map_err(|error| EffectError::Own { id: id.into(), error });
    }
    let family = subject.registry.family(id).ok_or_else(|| EffectError::Unknown { id: id.into() })?;
    (family.build)(&EffectId::new(id), subject)
}
