//! `payload_mass`: the flange carries more than was entered: `theta_J += c_J m z_J . ((c - o_J) x g)`.

use super::through_compliance::{NEEDS, twist};
use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
    Unphysical, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{EffectId, Owner, ParameterSpec};
use crate::units::Unit;

impl EffectId {
    /// The mass of the payload, which a dataset states.
    pub const PAYLOAD_MASS: &str = "payload_mass";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::PAYLOAD_MASS,
    arguments: "",
    name: "mass of the payload",
    what: "the payload's mass is not as entered",
    equation: "theta_J += c_J dtau_J(payload mass)",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::Load, Follows::Payload],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::AtLeastMinusPayload(Unphysical::NegativeMass),
    linear_range: LinearRange::Sizes(50.0),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the payload has another mass than entered; it acts through the compliance of the joints",
        intervention: Intervention {
            work: Work::Load,
            act: "weigh what the flange carries, and enter it",
            verify: "the scale; the same poses measured again",
        },
    },
    signature: Signature {
        looks: [
            "The compliance that was fitted is too soft for one payload and too stiff for the other.",
            "Each joint's error follows the torque of the payload about it.",
            "With one payload only, the fitted compliance absorbs it.",
        ],
        parted_by: "A pair of scales; or the same postures with a second payload of known mass.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameters = vec![ParameterSpec::new("payload_mass.m", Unit::KG, 0.2)];
        Shape::new(id, parameters, |at, emit| {
            let centre = at.posture.flange().point(&at.payload.com);
            twist(at, 0, at.q.len(), |_, origin| (centre - origin).cross(&at.gravity), emit);
        })
        .owner(Owner::Session)
        .needs(NEEDS)
        .built()
    },
};
