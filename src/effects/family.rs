//! The catalogue: families of effects, their origins, and their members for a robot and an artifact.

use super::*;
use crate::robot::JointKind;

/// Builds an effect from its id, for a robot and an artifact.
pub type Build = fn(&EffectId, &Subject<'_>) -> Result<Box<dyn Effect>, EffectError>;

/// Origin of an effect: tables separate them, since the remedy differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The arm itself: the object of a calibration.
    Arm,
    /// The TriCal and its mounting on the flange.
    Gauge,
    /// The balls and their supports.
    Artifact,
    /// The set-up of arm, load and instruments on the day.
    SetUp,
}

impl Origin {
    /// In the order of tables.
    pub const ALL: [Origin; 4] = [Origin::Arm, Origin::Gauge, Origin::Artifact, Origin::SetUp];

    /// As in tables and JSON.
    pub fn name(self) -> &'static str {
        ["arm", "gauge", "artifact", "set-up"][self as usize]
    }
}

/// The argument of a member that has to be found by a scan: its last one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scan {
    /// Nothing.
    None,
    /// Order, per revolution: a whole number.
    Order,
    /// Time: seconds since the session began.
    Time,
    /// Sample: its id.
    Sample,
}

/// An entry of the catalogue.
pub struct Family {
    /// The id before the first colon.
    pub id: &'static str,
    /// Its arguments: `""`, `":J"` (a joint), `":J:K"`, `":B"` (a ball), `":I"` (an indicator), `":T"` (a time).
    pub arguments: &'static str,
    /// Its name in plain words, with its arguments in braces as [`Registry::in_words`](super::registry::Registry::in_words) fills them in.
    pub name: &'static str,
    /// Description, in a sentence.
    pub what: &'static str,
    /// The equation, per unit of its parameters.
    pub equation: &'static str,
    /// Its origin.
    pub origin: Origin,
    /// The argument to be scanned.
    pub scan: Scan,
    /// The quantities on which the error depends, the main one first; empty if it is always present.
    pub follows: &'static [Follows],
    /// Its role in a model.
    pub role: Role,
    /// Condition under which a diagnosis offers it.
    pub offered: Offered,
    /// The values that its parameters can have.
    pub physical: Physical,
    /// The size beyond which its parameters are not credible.
    pub linear_range: LinearRange,
    /// Its periods per revolution of its joint.
    pub period: Period,
    /// The shape of a joint's error over what it follows.
    pub curve: CurveShape,
    /// Its meaning, and what to inspect.
    pub meaning: Meaning,
    /// Its appearance in the residuals.
    pub signature: Signature,
    /// Possible deviation of its true shape from the equation.
    pub stray: Stray,
    /// The effect with which it is exactly aliased in some data.
    pub alias: Alias,
    /// Arguments of its members (`""`, `":2"`), except the scanned one.
    pub members: fn(&Subject<'_>) -> Vec<String>,
    /// Builds the effect from its whole id, split at the colons.
    pub build: Build,
}

impl Family {
    /// Ids of all members for that robot and artifact; empty for a family that has to be scanned.
    pub fn ids(&self, subject: &Subject<'_>) -> Vec<String> {
        if self.scan == Scan::None { self.with(subject, "") } else { Vec::new() }
    }

    /// Ids of the members of a scanned family at one value of its last argument, e.g. order `17` or time `600`.
    pub fn scanned(&self, subject: &Subject<'_>, value: &str) -> Vec<String> {
        if self.scan == Scan::None { Vec::new() } else { self.with(subject, &format!(":{value}")) }
    }

    /// The first joint named by an id of this family, counted from 1; `None` if its members do not belong to a joint, or if
    /// the id names none.
    pub fn joint(&self, id: &EffectId) -> Option<usize> {
        if self.is_of_joint() { id.number(0) } else { None }
    }

    /// True if its ids begin with a joint.
    pub fn is_of_joint(&self) -> bool {
        self.arguments.starts_with(":J")
    }

    /// True if it has one member per joint and nothing to scan.
    pub fn is_per_joint(&self) -> bool {
        self.arguments == ":J" && self.scan == Scan::None
    }

    fn with(&self, subject: &Subject<'_>, end: &str) -> Vec<String> {
        (self.members)(subject).iter().map(|arguments| format!("{}{arguments}{end}", self.id)).collect()
    }
}

/// Members: a single one, without arguments.
pub(super) fn alone(_: &Subject<'_>) -> Vec<String> {
    vec![String::new()]
}

/// Members: none, because they are known by the data alone.
pub(super) fn by_name(_: &Subject<'_>) -> Vec<String> {
    Vec::new()
}

/// Members: one per joint that turns.
pub(super) fn each_joint(subject: &Subject<'_>) -> Vec<String> {
    turning(subject).map(|j| format!(":{j}")).collect()
}

/// Members: one per joint, prismatic ones included.
pub(super) fn any_joint(subject: &Subject<'_>) -> Vec<String> {
    (1..=subject.robot.joints()).map(|j| format!(":{j}")).collect()
}

/// The joints that turn, counted from 1.
pub(super) fn turning<'a>(subject: &Subject<'a>) -> impl Iterator<Item = usize> + Clone + use<'a> {
    let robot = subject.robot;
    (1..=robot.joints()).filter(|j| robot.kind(j - 1) == JointKind::Revolute)
}

/// Members: one per indicator.
pub(super) fn each_indicator(_: &Subject<'_>) -> Vec<String> {
    (1..=3).map(|i| format!(":{i}")).collect()
}

/// Members: one per ball.
pub(super) fn each_ball(subject: &Subject<'_>) -> Vec<String> {
    subject.balls.iter().map(|b| format!(":{b}")).collect()
}
