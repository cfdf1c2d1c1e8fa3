//! The catalogue: families of effects, where each comes from, and which members it has for a robot and an artifact.

use super::*;

/// Builds an effect from its id, for a robot and an artifact.
pub type Build = fn(&EffectId<'_>, &Subject<'_>) -> Result<Box<dyn Effect>, EffectError>;

/// Where an effect comes from: tables keep them apart, since the remedy differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The arm itself: what a calibration is for.
    Arm,
    /// The TriCal and its place on the flange.
    Gauge,
    /// The balls and what carries them.
    Artifact,
    /// How arm, load and instruments were set up that day.
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

/// What has to be tried out before a member of the family is known: its last argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scan {
    /// Nothing.
    None,
    /// How often per turn: a whole number.
    Order,
    /// When: seconds since the session began.
    Time,
    /// At which sample: its id.
    Sample,
}

/// An entry of the catalogue.
pub struct Family {
    /// The id before the first colon.
    pub id: &'static str,
    /// What may follow: `""`, `":J"` (a joint), `":J:K"`, `":B"` (a ball), `":I"` (an indicator), `":T"` (a time).
    pub arguments: &'static str,
    /// What it is, in a sentence.
    pub what: &'static str,
    /// What it adds, per unit of its parameters.
    pub equation: &'static str,
    /// Where it comes from.
    pub origin: Origin,
    /// What has to be tried out.
    pub scan: Scan,
    /// What the error follows, the main thing first; empty where it is always there.
    pub follows: &'static [Follows],
    /// What it is to a model.
    pub role: Role,
    /// When a diagnosis offers it.
    pub offered: Offered,
    /// Which values its parameters can have.
    pub physical: Physical,
    /// How large its parameters may be before they are not believable.
    pub linear_range: LinearRange,
    /// How often it repeats in a turn of its joint.
    pub period: Period,
    /// What it means, and where to look.
    pub meaning: Meaning,
    /// How its true shape may differ from the equation.
    pub stray: Stray,
    /// Arguments of its members (`""`, `":2"`), but for the one that is scanned.
    pub members: fn(&Subject<'_>) -> Vec<String>,
    /// Builds the effect from its whole id, split at the colons.
    pub build: Build,
}

impl Family {
    /// Ids of all members for that robot and artifact; none of a family that has to be scanned.
    pub fn ids(&self, subject: &Subject<'_>) -> Vec<String> {
        if self.scan == Scan::None { self.with(subject, "") } else { Vec::new() }
    }

    /// Ids of the members of a scanned family at one value of its last argument, e.g. order `17` or time `600`.
    pub fn scanned(&self, subject: &Subject<'_>, value: &str) -> Vec<String> {
        if self.scan == Scan::None { Vec::new() } else { self.with(subject, &format!(":{value}")) }
    }

    /// The joint that an id of this family names first, counted from 1; `None` when its members are not of a joint, or it names none.
    pub fn joint(&self, id: &EffectId<'_>) -> Option<usize> {
        if self.is_of_joint() { id.number(0) } else { None }
    }

    /// Whether its ids name a joint first.
    pub fn is_of_joint(&self) -> bool {
        self.arguments.starts_with(":J")
    }

    /// Whether its members are one a joint, with nothing to be tried out.
    pub fn is_per_joint(&self) -> bool {
        self.arguments == ":J" && self.scan == Scan::None
    }

    fn with(&self, subject: &Subject<'_>, end: &str) -> Vec<String> {
        (self.members)(subject).iter().map(|arguments| format!("{}{arguments}{end}", self.id)).collect()
    }
}

/// Members: one, without arguments.
pub(super) fn alone(_: &Subject<'_>) -> Vec<String> {
    vec![String::new()]
}

/// Members: one a joint.
pub(super) fn each_joint(subject: &Subject<'_>) -> Vec<String> {
    (1..=subject.robot.joints()).map(|j| format!(":{j}")).collect()
}

/// Members: one an indicator.
pub(super) fn each_indicator(_: &Subject<'_>) -> Vec<String> {
    (1..=3).map(|i| format!(":{i}")).collect()
}

/// Members: one a ball.
pub(super) fn each_ball(subject: &Subject<'_>) -> Vec<String> {
    subject.balls.iter().map(|b| format!(":{b}")).collect()
}

/// Every effect that plant, model and diagnosis know.
pub const CATALOGUE: &[Family] = &[
    base_frame::FAMILY,
    mdh::FAMILY,
    joint_compliance::FAMILY,
    stiffening::FAMILY,
    cross_compliance::FAMILY,
    gravity_backlash::FAMILY,
    lumped_gravity::FAMILY,
    hysteresis::FAMILY,
    harmonic::ONCE,
    harmonic::TWICE,
    harmonic::ANY,
    error_curve::FAMILY,
    joint_scale::FAMILY,
    wrist_coupling::FAMILY,
    joint_source::FAMILY,
    product::FAMILY,
    bearing_tilt::FAMILY,
    link_bending::FAMILY,
    link_mass::FAMILY,
    thermal_growth::FAMILY,
    thermal_joint::FAMILY,
    joint_step::FAMILY,
    tool_frame::FAMILY,
    tool_step::FAMILY,
    gauge_zero::FAMILY,
    gauge_gain::FAMILY,
    gauge_tilt::FAMILY,
    stiction::FAMILY,
    ball::FAMILY,
    ball_step::FAMILY,
    artifact_scale::FAMILY,
    artifact_sag::FAMILY,
    artifact_step::FAMILY,
    pedestal::FAMILY,
    payload_mass::FAMILY,
    payload_com::FAMILY,
    payload_moment::FAMILY,
    unsettled::FAMILY,
    gravity_direction::FAMILY,
    base_drift::FAMILY,
    base_step::FAMILY,
    tracker_registration::FAMILY,
    outlier::FAMILY,
];
