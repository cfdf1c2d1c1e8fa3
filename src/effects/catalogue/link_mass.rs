//! `link_mass`: links 2, 3 and 4 are heavier than entered, by a share of their mass: `theta_J += c_J m_k z_J . ((c_k - o_J)
//! x g)`.
//!
//! Link 1 turns about the vertical and loads no joint; the links after 4 are light, and so close to the flange that they
//! are aliased with a wrong payload.

use super::through_compliance::{NEEDS, twist};
use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
    Unphysical,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{EffectId, ParameterSpec};
use crate::units::Unit;

impl EffectId {
    /// The masses of the links, which the description of the robot states.
    pub const LINK_MASS: &str = "link_mass";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::LINK_MASS,
    arguments: "",
    name: "masses of links 2, 3 and 4",
    what: "links 2, 3, 4 are heavier than entered",
    equation: "theta_J += c_J dtau_J(share of mass)",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::Load],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::AtLeast(-1.0, Unphysical::NegativeMass),
    linear_range: LinearRange::Si(2.0),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the arm's links have other masses than entered; it acts through the compliance of the joints",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "It looks like a compliance that is somewhat wrong, in several joints at once.",
            "Each joint's error follows the part of the torque that its own links cause.",
            "A change of payload does not change it.",
        ],
        parted_by: "The joint torques that the controller reports, with the payload off; a change of payload distinguishes link from payload.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, subject| {
        id.at_most(0)?;
        let links = 1..subject.robot.joints().min(4);
        let name = |link| format!("link_mass.link{}", link + 1);
        // No manufacturer publishes masses of the KR6; those of its successor differ by about this share.
        let parameters = links.clone().map(|link| ParameterSpec::new(name(link), Unit::RATIO, 0.15)).collect();
        Shape::new(id, parameters, move |at, emit| {
            for (k, i) in links.clone().enumerate() {
                let link = &at.robot.links[i];
                let (centre, weight) = (at.posture.frame(i + 1).point(&link.com), at.gravity * link.mass);
                twist(at, k, i + 1, |_, origin| (centre - origin).cross(&weight), emit);
            }
        })
        .needs(NEEDS)
        .built()
    },
};
