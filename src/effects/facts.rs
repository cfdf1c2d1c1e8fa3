//! What is known about a family of effects beside its equation: data of its own file, from which warnings, sentences, suggestions and the
//! simulator's shape errors are made.

use super::{EffectId, ParameterSpec};

/// What the error at a sample follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Follows {
    /// The joint's own angle, by a shape that is known only where it was seen.
    JointAngle,
    /// The joint's own angle, as a straight line.
    JointAngleInProportion,
    /// Angles of other joints, as straight lines.
    OtherAngles,
    /// The joint's own torque.
    JointTorque,
    /// The torque of another joint.
    OtherTorque,
    /// Moments and forces of gravity, of whatever direction.
    Load,
    /// Which payload is carried.
    Payload,
    /// The side from which the joint came.
    Approach,
    /// What the joint was commanded beyond what was read.
    Commanded,
    /// The joint's last move.
    LastMove,
    /// Time within the session.
    Time,
    /// Temperature of the robot.
    Temperature,
    /// Nothing: the same in the world at every sample.
    World,
    /// Nothing: the same in the tool's axes at every sample.
    Tool,
    /// Indicator readings left over.
    Reading,
    /// The side from which a plunger came.
    Plunger,
    /// Which ball is probed.
    Ball,
    /// Where in the artifact the ball is.
    PlaceInArtifact,
    /// Where the measured point is.
    Point,
    /// One sample.
    Sample,
}

/// What a family is to a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Part of every model: the description of a robot is no better than its maker, so nothing holds the sizes.
    Baseline,
    /// A cause of which every robot has a little, held to plausible sizes when it is fitted.
    Cause,
    /// A cause that is there or is not: held to plausible sizes, and no part of what an ordinary robot is expected to have.
    Event,
    /// No cause, but a way to draw any curve: never named by a diagnosis.
    AnyShape,
}

/// When a diagnosis offers the members of a family; by name they can be added to any model that the data can test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offered {
    /// Always.
    Always,
    /// Always, and all members at once as one candidate.
    AsWholeToo,
    /// Where balls are not all that is measured: it is exactly another effect where they are.
    BesideOtherTargets,
    /// Where no payload was entered.
    WithoutPayload,
    /// Where the robot's description holds no link masses.
    WithoutMasses,
    /// Where the samples are a log of moves: with times, sides of approach or commanded joints.
    ToLogs,
    /// Never by itself.
    ByName,
}

/// What is impossible about a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unphysical {
    /// A joint, a bearing, a link or a pedestal that gives way against its load.
    NegativeCompliance,
    /// A gearbox that gets softer under load.
    Softening,
    /// Lost motion that the load closes on the other side.
    LostMotionAgainstLoad,
    /// A mass below zero.
    NegativeMass,
}

/// Which values a parameter of the family can have, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Physical {
    /// Of either sign.
    Any,
    /// Not below this.
    AtLeast(f64, Unphysical),
    /// Not above this.
    AtMost(f64, Unphysical),
    /// No further below zero than the payload that was entered weighs, kg.
    AtLeastMinusPayload(Unphysical),
}

impl Physical {
    /// What is impossible about `value` (SI) by more than `margin`; `heaviest` is the mass of the heaviest payload entered, kg.
    pub fn violated(&self, value: f64, margin: f64, heaviest: f64) -> Option<Unphysical> {
        match *self {
            Physical::AtLeast(limit, why) if value < limit - margin => Some(why),
            Physical::AtMost(limit, why) if value > limit + margin => Some(why),
            Physical::AtLeastMinusPayload(why) if value < -heaviest - margin => Some(why),
            _ => None,
        }
    }
}

/// How large a parameter may be before neither its equation nor its cause is to be believed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LinearRange {
    /// Any size: fits iterate over it.
    Unlimited,
    /// So many plausible sizes.
    Sizes(f64),
    /// This amount, SI, the same for all parameters of the family.
    Si(f64),
}

impl LinearRange {
    /// Whether a parameter is believable when it deviates from its nominal value by `deviation` (SI).
    pub fn holds(&self, spec: &ParameterSpec, deviation: f64) -> bool {
        match *self {
            LinearRange::Unlimited => true,
            LinearRange::Sizes(sizes) => deviation.abs() <= sizes * spec.prior,
            LinearRange::Si(most) => deviation.abs() <= most,
        }
    }
}

/// How often the error repeats in a turn of its joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Period {
    /// Not at all, or with many orders at once.
    None,
    /// So many times.
    PerTurn(u32),
    /// As many times as the last argument of the id says.
    LastArgument,
}

impl Period {
    /// Periods per turn of the effect of that id.
    pub fn per_turn(&self, id: &EffectId<'_>) -> Option<u32> {
        match *self {
            Period::None => None,
            Period::PerTurn(order) => Some(order),
            Period::LastArgument => id.last_argument()?.parse().ok(),
        }
    }
}

/// What stands behind a family, in the words of the shop floor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Meaning {
    /// The physics, in a clause.
    pub physics: &'static str,
    /// Where to look before it is added to the model; empty where the model is the place to mend it.
    pub look: &'static str,
}

/// How the true shape of an effect may differ from the equation of the catalogue, at full mismatch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stray {
    /// The equation has no constant that a robot need not keep to.
    None,
    /// A power of the load: `nominal` in the equation, truly up to `spread` more or less.
    Power {
        /// As in the equation.
        nominal: f64,
        /// Up to so much more or less.
        spread: f64,
    },
    /// `tanh` closes at up to this factor more or less of the torque.
    Closing(f64),
    /// Up to so much of the size appears at three times the order, `sin` and `cos` alternating.
    Overtone(f64),
    /// Time constants are up to this factor longer or shorter.
    Slower(f64),
    /// The moment, the last argument of the id (s), lies anywhere in the session.
    Moment,
}
