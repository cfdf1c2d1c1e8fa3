//! Possible errors of an arm, its gauge, its artifact or its set-up: one file per physical effect, one [`catalogue`].
//!
//! An effect defines its shape, never its size. It lists the [`Site`]s it moves, per unit of each of its parameters, in a
//! given [`Situation`]; it is linear in its parameters and arbitrary in everything else. The plant holds one set of sizes
//! (the ground truth), the model another (the estimate). User-defined effects ([`OwnEffect`]) are written as expressions
//! and treated like all others.

pub mod catalogue;
pub mod error_field;
mod expression;
pub mod facts;
pub mod family;
mod id;
pub mod own;
mod reference_torque;
pub mod registry;
mod shape;
pub mod situation;
mod words;

pub use id::EffectId;
pub use reference_torque::reference_torque;
pub use words::variable_in_words;

use thiserror::Error;

use self::error_field::ErrorField;
use self::facts::{Alias, CurveShape, Follows, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray};
use self::own::{OwnEffect, OwnEffectError};
use self::registry::Registry;
use self::situation::Situation;

use crate::robot::Robot;
use crate::robot::sites::Site;
use crate::units::Unit;

/// One parameter of an effect: its name, its unit and its plausible size.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterSpec {
    /// Unique among all effects, e.g. `a2`, `c3`, `harmonic1:2.sin`.
    pub name: String,
    /// Unit for people and files.
    pub unit: Unit,
    /// Nominal value, SI; the parameter is the deviation from it.
    pub nominal: f64,
    /// Plausible size (1 sigma of the prior), SI.
    pub prior: f64,
}

impl ParameterSpec {
    /// A parameter whose nominal value is zero.
    pub fn new(name: impl Into<String>, unit: Unit, prior: f64) -> Self {
        ParameterSpec { name: name.into(), unit, nominal: 0.0, prior }
    }

    /// Three such parameters, `NAME.x` to `NAME.z`.
    fn xyz(name: &str, unit: Unit, prior: f64) -> Vec<Self> {
        ["x", "y", "z"].iter().map(|axis| ParameterSpec::new(format!("{name}.{axis}"), unit, prior)).collect()
    }
}

/// Requirement of an effect on the model or the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Joint torques: link masses in the robot's description, or `tau1_nm` ... `tauN_nm`.
    Torques,
    /// Link masses in the robot's description.
    Masses,
    /// `joint_compliance` in the model, and torques from masses: a load that differs from the entered one acts through it.
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
    /// Samples of kind `pose`.
    Orientations,
}

impl Needs {
    /// The requirement as named in the files.
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
            Needs::Orientations => "samples of kind pose",
        }
    }
}

/// The owner of a parameter: one robot may appear in several sessions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// The arm: shared by all sessions.
    Robot,
    /// The set-up: each session has its own.
    Session,
    /// The artifact, or the shape of the tool: each dataset has its own.
    Artifact,
}

/// Callback that takes a parameter (its index within the effect), a site, and the site's deviation per SI unit of the
/// parameter, SI.
pub type Emit<'e> = dyn FnMut(usize, Site, f64) + 'e;

/// A single source of error, with its parameters.
pub trait Effect: Send + Sync {
    /// Id as in the catalogue, with its arguments: `harmonic:2:17`.
    fn id(&self) -> &str;

    /// Its parameters.
    fn parameters(&self) -> &[ParameterSpec];

    /// The owner of the parameters.
    fn owner(&self) -> Owner {
        Owner::Robot
    }

    /// Requirements on the model or the data.
    fn needs(&self) -> &[Needs] {
        &[]
    }

    /// Its terms (parameter, site, weight), none of them zero, if they are the same in every situation, so that `terms`
    /// need not be called.
    fn constant(&self) -> Option<&[(usize, Site, f64)]> {
        None
    }

    /// Calls `emit(parameter, site, weight)` for every site moved: the deviation of the site is the sum of weight ×
    /// parameter (SI).
    fn terms(&self, at: &Situation<'_>, emit: &mut Emit<'_>);

    /// The user's expression by which a parameter moves a site; `None` for built-in effects.
    fn expression(&self, _parameter: usize, _site: Site) -> Option<&str> {
        None
    }
}

/// Everything needed to build an effect from its id.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// The robot.
    pub robot: &'a Robot,
    /// Names of the balls, in the order of the artifact.
    pub balls: &'a [String],
    /// The user-defined effects.
    pub own: &'a [OwnEffect],
    /// The available families.
    pub registry: &'a Registry,
    /// The field of joint errors of the model; `None` without one.
    pub field: Option<&'a std::sync::Arc<ErrorField>>,
    /// Names of the samples, if known: an effect that names another sample is then refused.
    pub samples: Option<&'a [String]>,
}

impl<'a> Subject<'a> {
    /// A robot and an artifact, with the families of the catalogue and no user-defined effects.
    pub fn new(robot: &'a Robot, balls: &'a [String]) -> Self {
        Subject { robot, balls, own: &[], registry: Registry::catalogue(), field: None, samples: None }
    }
}

/// The reason why an id does not name an effect.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum EffectError {
    /// No such family.
    #[error("there is no effect '{id}' in the catalogue, which docs/gallery lists")]
    Unknown {
        /// As given.
        id: String,
    },
    /// The arguments after the colon are not valid.
    #[error("effect '{id}': {problem}")]
    Argument {
        /// As given.
        id: String,
        /// The problem.
        problem: String,
    },
    /// A family cannot be added under an id already in use.
    #[error("there is a family '{id}' already; give the new one another id")]
    Taken {
        /// The id of both.
        id: String,
    },
    /// A user-defined effect is not well formed.
    #[error("effect '{id}': {error}")]
    Own {
        /// Its name.
        id: String,
        /// The error in it.
        error: OwnEffectError,
    },
}

/// Builds the effect with this id for the given robot and artifact.
///
/// ```
/// use calibench::effects::situation::Situation;
/// use calibench::effects::{Subject, build};
/// use calibench::robot::built_in;
/// use calibench::robot::kinematics::Posture;
/// use calibench::robot::statics::{Loads, Payload};
/// use calibench::units::DEG;
///
/// // theta_2 += s sin(q_2) + c cos(q_2), at 30 deg.
/// let robot = built_in("ur5").ok_or("built in")?;
/// let effect = build("harmonic1:2", &Subject::new(&robot, &[]))?;
/// let q = [0.0, 30.0 * DEG, 0.0, 0.0, 0.0, 0.0];
/// let (posture, loads, payload) = (Posture::new(&robot), Loads::new(6), Payload::none());
/// let mut weights = [0.0; 2];
/// let at = Situation::at_rest(&robot, &q, &posture, &loads, &payload);
/// effect.terms(&at, &mut |parameter, _site, weight| weights[parameter] = weight);
/// assert!((weights[0] - 0.5).abs() < 1e-15 && (weights[1] - 0.75f64.sqrt()).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If no family and no user-defined effect has the name, or if its arguments do not fit the robot or the artifact.
pub fn build(id: &str, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    if let Some(own) = subject.own.iter().find(|e| e.name == id) {
        return own.build(subject).map_err(|error| EffectError::Own { id: id.into(), error });
    }
    if id == EffectId::ERROR_FIELD {
        return error_field::error_field(&EffectId::new(id), subject);
    }
    let family = subject.registry.family(id).ok_or_else(|| EffectError::Unknown { id: id.into() })?;
    (family.build)(&EffectId::new(id), subject)
}
