//! `base_drift`: base and artifact drift apart, `base += (x, y, z) t` in the world, t being time as a share of the session.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::robot::sites::{Axis6, Site};
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "base_drift",
    arguments: "",
    name: "drift of the base against the artifact",
    what: "base and artifact drift apart",
    equation: "base += (x, y, z) t",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::World, Follows::Time],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "base and artifact drift apart in the course of the session",
        intervention: Intervention {
            work: Work::Base,
            act: "check the clamps of base and artifact, and sunlight",
            verify: "one pose measured every ten minutes for an hour stays",
        },
    },
    signature: Signature {
        looks: [
            "All residuals creep in the same direction of the room.",
            "Over time the points of a room axis rise along a ramp.",
            "Posture and load do not change it.",
        ],
        parted_by: "One posture repeated throughout the session: a ramp is heat or creep, a step is a bump.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        Shape::new(id, ParameterSpec::xyz("base_drift", Unit::MM, 0.02 * MM), |at, emit| {
            if let Some(t) = at.share_of_session() {
                (0..3).for_each(|k| emit(k, Site::Base(Axis6::ALL[k]), t));
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Time])
        .built()
    },
};
