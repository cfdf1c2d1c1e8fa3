//! Properties of a family of effects beside its equation: data of the family's own file, used for warnings, sentences,
//! suggestions and the simulator's shape errors.

use super::{EffectId, ParameterSpec};

/// The quantity on which the error at a sample depends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Follows {
    /// The joint's own angle, by a shape known only within the observed range.
    JointAngle,
    /// The joint's own angle, linearly.
    JointAngleInProportion,
    /// Angles of other joints, linearly.
    OtherAngles,
    /// The joint's own torque.
    JointTorque,
    /// The torque of another joint.
    OtherTorque,
    /// Moments and forces of gravity, in any direction.
    Load,
    /// The payload carried.
    Payload,
    /// The direction from which the joint approached.
    Approach,
    /// The difference between the commanded and the reported joint angle.
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
    /// Residual indicator readings.
    Reading,
    /// The direction from which a plunger approached.
    Plunger,
    /// The ball being probed.
    Ball,
    /// The position of the ball in the artifact.
    PlaceInArtifact,
    /// The position of the measured point.
    Point,
    /// One sample.
    Sample,
}

/// The role of a family in a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Part of every model: a robot's description is not better than its manufacturer, so no prior holds the sizes.
    Baseline,
    /// A cause present to some extent in every robot, held to plausible sizes when fitted.
    Cause,
    /// A cause that is either present or absent: held to plausible sizes, and not part of what is expected of an ordinary
    /// robot.
    Event,
    /// Not a cause, but a basis for arbitrary curves: never named by a diagnosis.
    AnyShape,
}

/// Condition under which a diagnosis offers the members of a family; by name they can be added to any model that the data can
/// test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offered {
    /// Always.
    Always,
    /// Always, and also all members together as one candidate.
    AsWholeToo,
    /// If not only balls are measured: with balls alone it is exactly aliased with another effect.
    BesideOtherTargets,
    /// If no payload was entered.
    WithoutPayload,
    /// If the robot's description holds no link masses.
    WithoutMasses,
    /// If the samples are a log of moves: with times, approach directions or commanded joints.
    ToLogs,
    /// If orientations are measured too.
    ToOrientations,
    /// If samples were measured, whose order it follows.
    InOrder,
    /// Of a ball with a known place, if it was probed: a free one is fitted in any case, and of one that was not probed the data say nothing.
    OnKnownBalls,
    /// Only by name.
    ByName,
}

/// The reason why a value is physically impossible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unphysical {
    /// A joint, a bearing, a link or a pedestal that deflects against its load.
    NegativeCompliance,
    /// A gearbox that softens under load.
    Softening,
    /// Lost motion that the load closes in the wrong direction.
    LostMotionAgainstLoad,
    /// A mass below zero.
    NegativeMass,
}

impl Unphysical {
    /// Families whose absence from a model pushes a value of the same joint there.
    pub fn symptom_of(self) -> &'static [&'static str] {
        match self {
            Unphysical::NegativeCompliance => &[EffectId::STIFFENING, EffectId::HARMONIC_1, EffectId::HARMONIC_2],
            Unphysical::Softening => &[EffectId::HARMONIC_1, EffectId::GRAVITY_BACKLASH],
            Unphysical::LostMotionAgainstLoad => &[EffectId::STIFFENING, EffectId::HARMONIC_1],
            Unphysical::NegativeMass => &[],
        }
    }
}

/// The values that a parameter of the family can have, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Physical {
    /// Either sign.
    Any,
    /// No less than this.
    AtLeast(f64, Unphysical),
    /// No more than this.
    AtMost(f64, Unphysical),
    /// No further below zero than the mass of the payload entered, kg.
    AtLeastMinusPayload(Unphysical),
}

impl Physical {
    /// The reason why `value` (SI) is impossible by more than `margin`, if it is; `heaviest` is the mass of the heaviest
    /// payload entered, kg.
    ///
    /// ```
    /// use calibench::effects::facts::{Physical, Unphysical};
    ///
    /// // A compliance of -2e-6 rad/(N·m), known to 1e-6 and to 3e-6.
    /// let physical = Physical::AtLeast(0.0, Unphysical::NegativeCompliance);
    /// assert_eq!(physical.violated(-2e-6, 1e-6, 0.0), Some(Unphysical::NegativeCompliance));
    /// assert_eq!(physical.violated(-2e-6, 3e-6, 0.0), None);
    /// ```
    pub fn violated(&self, value: f64, margin: f64, heaviest: f64) -> Option<Unphysical> {
        match *self {
            Physical::AtLeast(limit, why) if value < limit - margin => Some(why),
            Physical::AtMost(limit, why) if value > limit + margin => Some(why),
            Physical::AtLeastMinusPayload(why) if value < -heaviest - margin => Some(why),
            _ => None,
        }
    }
}

/// The size of a parameter beyond which neither its equation nor its cause is credible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LinearRange {
    /// Any size: fits iterate over it.
    Unlimited,
    /// This multiple of the plausible size.
    Sizes(f64),
    /// This amount, SI, the same for all parameters of the family.
    Si(f64),
}

impl LinearRange {
    /// True if a parameter is credible when it deviates from its nominal value by `deviation` (SI).
    ///
    /// ```
    /// use calibench::effects::ParameterSpec;
    /// use calibench::effects::facts::LinearRange;
    /// use calibench::units::{MM, Unit};
    ///
    /// let length = ParameterSpec::new("a1", Unit::MM, 0.1 * MM);
    /// assert!(LinearRange::Sizes(10.0).holds(&length, -0.9 * MM));
    /// assert!(!LinearRange::Sizes(10.0).holds(&length, 1.1 * MM));
    /// ```
    pub fn holds(&self, spec: &ParameterSpec, deviation: f64) -> bool {
        match *self {
            LinearRange::Unlimited => true,
            LinearRange::Sizes(sizes) => deviation.abs() <= sizes * spec.prior,
            LinearRange::Si(most) => deviation.abs() <= most,
        }
    }
}

/// Number of periods of the error in one revolution of its joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Period {
    /// Not periodic, or with many orders at once.
    None,
    /// This number.
    PerTurn(u32),
    /// The last argument of the id.
    LastArgument,
}

impl Period {
    /// Periods per revolution of the effect with this id.
    ///
    /// ```
    /// use calibench::effects::EffectId;
    /// use calibench::effects::registry::Registry;
    ///
    /// let ripple = Registry::catalogue().family("harmonic").ok_or("in the catalogue")?;
    /// assert_eq!(ripple.period.per_turn(&EffectId::new("harmonic:2:17")), Some(17));
    /// # Ok::<(), &str>(())
    /// ```
    pub fn per_turn(&self, id: &EffectId) -> Option<u32> {
        match *self {
            Period::None => None,
            Period::PerTurn(order) => Some(order),
            Period::LastArgument => id.last_argument()?.parse().ok(),
        }
    }
}

/// The shape of a joint's error over the variable that it follows first, by which a family is recognised in a measured curve.
///
/// Its members are `FAMILY:J`; those that follow the torque of another joint are `FAMILY:J:K`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveShape {
    /// None that tells it from others.
    None,
    /// In proportion to the variable.
    Line,
    /// As often per revolution as its [`Period`] says.
    Wave,
    /// In proportion to the square of the variable, with its sign.
    Square,
    /// By the sign of the variable alone.
    Sign,
}

/// Another effect that moves the same samples by the same amounts, so that no fit can distinguish the two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alias {
    /// None.
    None,
    /// If only balls are measured, the member of this family with the same arguments.
    OnBalls(&'static str),
    /// The sample set aside, if the effect moves only one: its first argument is a ball, its last the time if it is a step.
    OfOnlySample,
}

/// The meaning of a family, in shop-floor terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Meaning {
    /// The physics, in a clause.
    pub physics: &'static str,
    /// What to do about it.
    pub intervention: Intervention,
}

/// What a maintenance engineer does about an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Intervention {
    /// The kind of work.
    pub work: Work,
    /// What to do before the effect is added to the model; empty if it is to be corrected in the model.
    pub act: &'static str,
    /// The measurement that shows that it helped; empty without `act`.
    pub verify: &'static str,
}

impl Intervention {
    /// The robot is as it was made: the model corrects it.
    pub const IN_THE_MODEL: Intervention = Intervention { work: Work::Model, act: "", verify: "" };
}

/// Kinds of work on a robot cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// Master a joint again.
    Remaster,
    /// Tighten or stiffen the tool.
    Tool,
    /// Measure the TCP again.
    TcpMeasured,
    /// Secure base, pedestal or artifact.
    Base,
    /// Warm the arm up.
    WarmUp,
    /// Have a belt or a gear adjusted.
    Service,
    /// Enter the load that the flange carries.
    Load,
    /// Correct a setting of the controller.
    Setting,
    /// Look at the artifact or a target.
    Artifact,
    /// Look at the gauge, the tracker or the camera.
    Instrument,
    /// Repeat a sample or leave it out.
    Sample,
    /// Measure in another way.
    Procedure,
    /// Leave the robot alone, and correct the effect in the model.
    Model,
}

impl Work {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Work::Remaster => "re_master",
            Work::Tool => "secure_tool",
            Work::TcpMeasured => "measure_tool",
            Work::Base => "secure_base",
            Work::WarmUp => "warm_up",
            Work::Service => "service",
            Work::Load => "enter_load",
            Work::Setting => "correct_setting",
            Work::Artifact => "look_at_artifact",
            Work::Instrument => "look_at_instrument",
            Work::Sample => "repeat_sample",
            Work::Procedure => "measure_otherwise",
            Work::Model => "leave_alone",
        }
    }

    /// What happens if nothing is done, as a clause.
    pub fn if_nothing_is_done(self) -> &'static str {
        match self {
            Work::Remaster => "every program is off by that angle times the reach beyond the joint",
            Work::Tool => "no tool frame holds, and the next load moves it again",
            Work::TcpMeasured => "every program with this tool is off by as much as the tool",
            Work::Base => "every program is off by as much as it moved, and it will move again",
            Work::WarmUp => "the error comes and goes with every start",
            Work::Service => "it grows with wear, and the calibration ages with it",
            Work::Load => "the arm bends otherwise than predicted, and the controller computes with wrong torques",
            Work::Setting => "every motion of the joint is off by that share",
            Work::Artifact => "the robot is blamed for what the artifact does",
            Work::Instrument => "the calibration learns the error of the instrument",
            Work::Sample => "one sample pulls the whole fit towards it",
            Work::Procedure => "the calibration learns an error that the robot does not have",
            Work::Model => "the error stays as it is, and does not grow",
        }
    }
}

/// Appearance of an effect in the residuals, for a reader without equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Signature {
    /// Three plain sentences: what strikes the eye first, the shape in the view that shows it best, and what it does not
    /// depend on or how it grows.
    pub looks: [&'static str; 3],
    /// The measurement that parts it from what imitates it.
    pub parted_by: &'static str,
}

/// Deviation of an effect's true shape from the catalogue's equation, at full mismatch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stray {
    /// The equation has no constant from which a robot might differ.
    None,
    /// A power of the load: `nominal` in the equation, in truth up to `spread` more or less.
    Power {
        /// As in the equation.
        nominal: f64,
        /// Largest deviation, more or less.
        spread: f64,
    },
    /// `tanh` closes at up to this factor more or less of the torque.
    Closing(f64),
    /// Up to this share of the size appears at three times the order, `sin` and `cos` alternating.
    Overtone(f64),
    /// Time constants are up to this factor longer or shorter.
    Slower(f64),
    /// The time, the last argument of the id (s), lies anywhere in the session.
    Moment,
}
