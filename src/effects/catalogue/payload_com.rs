//! `payload_com`: the payload's centre of mass is not at the entered position: `theta_J += c_J m z_J . (r x g)`, r in the
//! last frame.

use super::through_compliance::{NEEDS, twist};
use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{EffectId, Owner, ParameterSpec};
use crate::units::{MM, Unit};

impl EffectId {
    /// The centre of mass of the payload, which a dataset states.
    pub const PAYLOAD_COM: &str = "payload_com";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::PAYLOAD_COM,
    arguments: "",
    name: "centre of mass of the payload",
    what: "the payload's centre is not as entered",
    equation: "theta_J += c_J dtau_J(centre of mass)",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::Load, Follows::Payload],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the payload's centre of mass is not as entered; it acts through the compliance of the joints",
        intervention: Intervention {
            work: Work::Load,
            act: "check the centre of mass of the payload against its drawing, and enter it",
            verify: "the same poses with and without the payload",
        },
    },
    signature: Signature {
        looks: [
            "The wrist errs with the way the hand is turned, as far as it is soft.",
            "Against the angle of the last joints it is one swing per turn.",
            "It is gone when the payload is taken off.",
        ],
        parted_by: "The hand turned about the last joint in a posture that holds it level; the drawing of the payload.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        Shape::new(id, ParameterSpec::xyz("payload_com", Unit::MM, 10.0 * MM), |at, emit| {
            let flange = at.posture.flange();
            let weight = at.gravity * at.payload.mass;
            for (k, axis) in [flange.x, flange.y, flange.z].iter().enumerate() {
                twist(at, k, at.q.len(), |_, _| axis.cross(&weight), emit);
            }
        })
        .owner(Owner::Session)
        .needs(NEEDS)
        .built()
    },
};
