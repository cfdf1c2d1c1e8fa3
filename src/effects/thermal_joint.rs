//! `thermal_joint:J`: a joint's zero drifts, `theta_J += b t`, t being time as a share of the session.

use super::family::each_joint;
use super::shape::{per_joint, theta};
use super::{
    Family, Follows, LinearRange, Meaning, Needs, Offered, Origin, Owner, ParameterSpec, Period, Physical, Role, Scan, Stray,
};
use crate::units::{URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "thermal_joint",
    arguments: ":J",
    what: "a joint's zero drifts",
    equation: "theta_J += b t",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::Time, Follows::Temperature],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(2e-3),
    period: Period::None,
    meaning: Meaning { physics: "the zero of a joint drifts as its gear warms up", look: "warm the robot up, or log temp_c" },
    stray: Stray::None,
    members: each_joint,
    build: |id, subject| {
        per_joint(
            id,
            id.joints(subject)?,
            |_, name| vec![ParameterSpec::new(format!("{name}.b"), Unit::URAD, 60.0 * URAD)],
            |at, j, emit| {
                if let Some(t) = at.share_of_session() {
                    emit(0, theta(j), t);
                }
            },
        )
        .owner(Owner::Session)
        .needs(&[Needs::Time])
        .built()
    },
};
