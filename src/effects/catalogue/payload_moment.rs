//! `payload_moment`: the flange carries a payload that was not entered: mass m, and first moments s = m (centre of mass) in
//! the last frame: `theta_J += c_J z_J . ((m (f - o_J) + s) x g)`, f being the origin of the last frame. Linear in all
//! four.
//!
//! If a payload was entered, `payload_mass` and `payload_com` describe the deviation from it.

use super::through_compliance::{NEEDS, twist};
use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{Owner, ParameterSpec};
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "payload_moment",
    arguments: "",
    name: "payload that was not entered",
    what: "a payload was not entered",
    equation: "theta_J += c_J dtau_J(m, m com)",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::Load, Follows::Payload],
    role: Role::Event,
    offered: Offered::WithoutPayload,
    physical: Physical::Any,
    linear_range: LinearRange::Sizes(20.0),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the flange carries more than was entered; it acts through the compliance of the joints",
        intervention: Intervention {
            work: Work::Load,
            act: "enter the payload: its mass and its centre",
            verify: "the same poses with and without the payload",
        },
    },
    signature: Signature {
        looks: [
            "The robot hangs lower than it should, most with a long reach.",
            "Each joint's error follows a load that nobody has entered.",
            "It is gone when the payload is taken off.",
        ],
        parted_by: "The same postures without the payload; or its mass and centre, weighed and entered.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let mut parameters = vec![ParameterSpec::new("payload_moment.m", Unit::KG, 1.0)];
        let moment = |axis| ParameterSpec::new(format!("payload_moment.{axis}"), Unit::KG_M, 0.1);
        parameters.extend(["x", "y", "z"].map(moment));
        Shape::new(id, parameters, |at, emit| {
            let flange = at.posture.flange();
            twist(at, 0, at.q.len(), |_, origin| (flange.o - origin).cross(&at.gravity), emit);
            for (k, axis) in [flange.x, flange.y, flange.z].iter().enumerate() {
                twist(at, 1 + k, at.q.len(), |_, _| axis.cross(&at.gravity), emit);
            }
        })
        .owner(Owner::Session)
        .needs(NEEDS)
        .built()
    },
};
