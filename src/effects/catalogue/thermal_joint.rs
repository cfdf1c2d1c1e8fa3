//! `thermal_joint:J`: a joint's zero drifts, `theta_J += b t`, t being time as a share of the session.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::any_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{by_kind, per_joint};
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::units::{UM, URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "thermal_joint",
    arguments: ":J",
    name: "zero drift of {joint}",
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
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the zero of a joint drifts as its gear warms up",
        intervention: Intervention {
            work: Work::WarmUp,
            act: "let the arm run as long as before the calibration, or log temp_c",
            verify: "one pose measured every ten minutes stays",
        },
    },
    signature: Signature {
        looks: [
            "The error of one joint creeps in one direction.",
            "Over time the points rise along a ramp, whatever the posture.",
            "The residuals of one posture taken early and late differ by a turn of that joint.",
        ],
        parted_by: "One posture repeated at the beginning, in the middle and at the end; other joints folded and stretched, so that a turn of the joint differs from a drift of the base.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: any_joint,
    build: |id, subject| {
        let drift = |j| by_kind(subject.robot, j, [(Unit::URAD, 60.0 * URAD), (Unit::UM, 60.0 * UM)]);
        per_joint(
            id,
            id.any_joints(subject)?,
            |j, name| vec![ParameterSpec::new(format!("{name}.b"), drift(j).0, drift(j).1)],
            |at, j, emit| {
                if let Some(t) = at.share_of_session() {
                    emit(0, at.robot.joint_site(j), t);
                }
            },
        )
        .owner(Owner::Session)
        .needs(&[Needs::Time])
        .built()
    },
};
