//! `unsettled:J`: joint J was read before it had settled, `theta_J += s (q_J - q_J before)`: the error is a fraction of the
//! last move, from the posture of the previous sample in the order of measurement within the session.

use crate::effects::ParameterSpec;
use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::any_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{by_kind, per_joint};
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "unsettled",
    arguments: ":J",
    name: "{joint} read before it settled",
    what: "a joint was read before it settled",
    equation: "theta_J += s (q_J - q_J before)",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::LastMove],
    role: Role::Event,
    offered: Offered::ToLogs,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.02),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the joints were read before the arm had settled: the error is a part of the last move",
        intervention: Intervention {
            work: Work::Procedure,
            act: "wait longer before the joints are read",
            verify: "one pose read after one second and after ten",
        },
    },
    signature: Signature {
        looks: [
            "A sample after a long move is off, one after a short move is right.",
            "Against the last move of the joint the points lie on a line.",
            "In a different order of measurement the same postures have different residuals.",
        ],
        parted_by: "The same postures in another order, or with a longer wait before the joints are read.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: any_joint,
    build: |id, subject| {
        let unit = |j| by_kind(subject.robot, j, [Unit::URAD_PER_RAD, Unit::UM_PER_M]);
        per_joint(
            id,
            id.any_joints(subject)?,
            |j, name| vec![ParameterSpec::new(format!("{name}.s"), unit(j), unit(j).to_si(200.0))],
            |at, j, emit| {
                if let Some(before) = at.q_before.and_then(|q| q.get(j)) {
                    emit(0, at.robot.joint_site(j), at.q[j] - before);
                }
            },
        )
        .built()
    },
};
