//! `gravity_direction`: the world's z axis is not plumb, gravity being rotated by (x, y) about the world's x and y axes:
//! `theta_J += c_J z_J . sum_{k >= J} m_k (c_k - o_J) x (phi x g)`.

use nalgebra::Vector3;

use super::through_compliance::{NEEDS, twist};
use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::situation::Situation;
use crate::effects::{Owner, ParameterSpec};
use crate::units::{MRAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "gravity_direction",
    arguments: "",
    name: "cell out of level",
    what: "the cell is not level",
    equation: "theta_J += c_J dtau_J(turn about x, y)",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::Load],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.1),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the cell is not level",
        intervention: Intervention {
            work: Work::Base,
            act: "put a level on the base, and enter how it stands",
            verify: "the bubble, or the inclination entered in the controller",
        },
    },
    signature: Signature {
        looks: [
            "One side of the cell hangs low and the other high, as far as the joints are soft.",
            "The loaded joints err by an amount that turns with the first joint, though nothing is wrong with that joint.",
            "It is gone with a stiff arm.",
        ],
        parted_by: "A spirit level on the base; or two payloads on opposite sides of the cell.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameter = |axis| ParameterSpec::new(format!("gravity_direction.{axis}"), Unit::MRAD, 5.0 * MRAD);
        Shape::new(id, vec![parameter("x"), parameter("y")], |at, emit| {
            for (k, axis) in [Vector3::x(), Vector3::y()].iter().enumerate() {
                let turned = axis.cross(&at.gravity);
                twist(at, k, at.q.len(), |j, origin| first_moment(at, j, origin).cross(&turned), emit);
            }
        })
        .owner(Owner::Session)
        .needs(NEEDS)
        .built()
    },
};

/// First moment of everything carried by joint `j` (counted from 0), about a point, kg·m.
fn first_moment(at: &Situation<'_>, j: usize, about: &Vector3<f64>) -> Vector3<f64> {
    let payload = (at.posture.flange().point(&at.payload.com) - about) * at.payload.mass;
    let links = at.robot.links.iter().enumerate().skip(j);
    links.fold(payload, |sum, (i, link)| sum + (at.posture.frame(i + 1).point(&link.com) - about) * link.mass)
}
