//! `payload_mass`: the flange carries more than was entered: `theta_J += c_J m z_J . ((c - o_J) x g)`.

use super::family::alone;
use super::shape::Shape;
use super::through_compliance::{NEEDS, twist};
use super::{Family, Origin, Owner, ParameterSpec, Scan};
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "payload_mass",
    arguments: "",
    what: "the payload's mass is not as entered",
    equation: "theta_J += c_J dtau_J(payload mass)",
    origin: Origin::SetUp,
    scan: Scan::None,
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
