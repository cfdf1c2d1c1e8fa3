//! `joint_source:J`: the arm is at the commanded, not the reported, angle, `theta_J += s (q_commanded - q)`. s is 1 if the
//! command is correct and 0 if the reading is.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::any_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::per_joint;
use crate::effects::{Needs, ParameterSpec};
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "joint_source",
    arguments: ":J",
    name: "following error of {joint}",
    what: "following error: a joint is at the commanded, not the reported, angle",
    equation: "theta_J += s (q_commanded - q)",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::Commanded],
    role: Role::Event,
    offered: Offered::AsWholeToo,
    physical: Physical::Any,
    linear_range: LinearRange::Si(1.5),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the joints are where they were sent, not where they are reported to be",
        intervention: Intervention {
            work: Work::Procedure,
            act: "log the joints as the encoders read them",
            verify: "reported and commanded angles differ while the arm moves",
        },
    },
    signature: Signature {
        looks: [
            "Single samples are off by as much as the controller lagged behind its command.",
            "Against commanded minus reported angle the points lie on a line whose slope is one.",
            "With the arm at rest it is gone.",
        ],
        parted_by: "The commanded and the reported angles side by side (qcmd1_deg ...), and a few postures read once more after the arm has come to rest.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: any_joint,
    build: |id, subject| {
        per_joint(
            id,
            id.any_joints(subject)?,
            |_, name| vec![ParameterSpec::new(format!("{name}.s"), Unit::RATIO, 1.0)],
            |at, j, emit| {
                if let Some(commanded) = at.q_commanded.and_then(|q| q.get(j)) {
                    emit(0, at.robot.joint_site(j), commanded - at.q[j]);
                }
            },
        )
        .needs(&[Needs::Commanded])
        .built()
    },
};
