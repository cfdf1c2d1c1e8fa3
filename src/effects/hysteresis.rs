//! `hysteresis:J`: lost motion by the direction from which a joint approached, `theta_J += h approach_J`.
//!
//! Plausible: 30 urad, half the width of a strain-wave gear's loop at the torque of a small arm; the unidirectional
//! repeatability of an IRB 1600 leaves no room for more (Slamani, Nubiola, Bonev, Robotics and Computer-Integrated
//! Manufacturing 28 (2012)).

use super::family::each_joint;
use super::shape::{per_joint, theta};
use super::{
    Family, Follows, LinearRange, Meaning, Needs, Offered, Origin, ParameterSpec, Period, Physical, Role, Scan, Stray,
};
use crate::units::{URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "hysteresis",
    arguments: ":J",
    what: "lost motion by the side of the approach",
    equation: "theta_J += h approach_J",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::Approach],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(1e-3),
    period: Period::None,
    meaning: Meaning {
        physics: "a gear stops short on the side from which it came: friction and lost motion",
        look: "approach every pose from the same side",
    },
    stray: Stray::None,
    members: each_joint,
    build: |id, subject| {
        per_joint(
            id,
            id.joints(subject)?,
            |_, name| vec![ParameterSpec::new(format!("{name}.h"), Unit::URAD, 30.0 * URAD)],
            |at, j, emit| {
                if let Some(&side) = at.approach.and_then(|signs| signs.get(j)) {
                    emit(0, theta(j), f64::from(side));
                }
            },
        )
        .needs(&[Needs::Approach])
        .built()
    },
};
