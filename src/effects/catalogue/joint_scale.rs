//! `joint_scale:J`: the encoder or the gear ratio is off by a factor, `theta_J += s q_J`, or `d_J` of a
//! prismatic joint. The stiffness of cables and hoses looks the same.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::any_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{by_kind, per_joint};
use crate::effects::{EffectId, ParameterSpec};
use crate::units::Unit;

impl EffectId {
    /// An error in proportion to the angle.
    pub const JOINT_SCALE: &str = "joint_scale";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::JOINT_SCALE,
    arguments: ":J",
    name: "scale of {joint}",
    what: "a joint turns a share too far",
    equation: "theta_J += s q_J",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointAngleInProportion],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.01),
    period: Period::None,
    curve: CurveShape::Line,
    meaning: Meaning {
        physics: "a joint turns a constant share too far: a wrong gear ratio or encoder scale",
        intervention: Intervention {
            work: Work::Setting,
            act: "check the ratio of that joint entered in the controller",
            verify: "a full turn of the joint against a mark, or an angle gauge",
        },
    },
    signature: Signature {
        looks: [
            "The joint turns a fixed share too far: nothing at its zero, most at its ends.",
            "Against its own angle the error is a straight line; a fitted zero shifts it, and its ends bend where geometry absorbs a part of it.",
            "Load, time and the other joints do not change it.",
        ],
        parted_by: "The whole range of the joint, to both ends: there a line departs from the middle of a sine, and from what geometry can bend.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: any_joint,
    build: |id, subject| {
        let unit = |j| by_kind(subject.robot, j, [Unit::URAD_PER_RAD, Unit::UM_PER_M]);
        per_joint(
            id,
            id.any_joints(subject)?,
            |j, name| vec![ParameterSpec::new(format!("{name}.s"), unit(j), unit(j).to_si(100.0))],
            |at, j, emit| emit(0, at.robot.joint_site(j), at.q[j]),
        )
        .built()
    },
};
