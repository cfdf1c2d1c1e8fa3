//! `joint_scale:J`: the encoder or the gear ratio is off by a factor, `theta_J += s q_J`. The stiffness of cables and hoses
//! looks the same.

use super::family::each_joint;
use super::shape::{per_joint, theta};
use super::{Family, Follows, LinearRange, Meaning, Offered, Origin, ParameterSpec, Period, Physical, Role, Scan, Stray};
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "joint_scale",
    arguments: ":J",
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
    meaning: Meaning {
        physics: "a joint turns a constant share too far: a wrong gear ratio or encoder scale",
        look: "check the ratio entered in the controller",
    },
    stray: Stray::None,
    members: each_joint,
    build: |id, subject| {
        let unit = Unit::URAD_PER_RAD;
        per_joint(
            id,
            id.joints(subject)?,
            |_, name| vec![ParameterSpec::new(format!("{name}.s"), unit, unit.to_si(100.0))],
            |at, j, emit| emit(0, theta(j), at.q[j]),
        )
        .built()
    },
};
