//! `pedestal`: the base tilts under the overturning moment, `(rx, ry) += (k_x M_x, k_y M_y)` in the base frame.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
    Unphysical, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{EffectId, Needs, ParameterSpec};
use crate::robot::sites::{Axis6, Site};
use crate::units::{URAD, Unit};

impl EffectId {
    /// The pedestal that bends.
    pub const PEDESTAL: &str = "pedestal";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::PEDESTAL,
    arguments: "",
    name: "compliance of the pedestal",
    what: "the base tips under the overturning moment",
    equation: "base rotation (x, y) += (k_x M_x, k_y M_y)",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::Load, Follows::World],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::AtLeast(0.0, Unphysical::NegativeCompliance),
    linear_range: LinearRange::Sizes(50.0),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "what the robot stands on tips under its overturning moment",
        intervention: Intervention {
            work: Work::Base,
            act: "check the anchor bolts of the pedestal",
            verify: "an inclinometer on the base, with the arm stretched to opposite sides",
        },
    },
    signature: Signature {
        looks: [
            "The base leans after the load, so that the whole arm tips outwards.",
            "The error turns with the first joint: it always points to where the arm reaches.",
            "It grows with the height of the tool and with the payload.",
        ],
        parted_by: "Opposite sides of the pedestal with the arm stretched, with two payloads; an inclinometer on the base settles it.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameter = |axis| ParameterSpec::new(format!("pedestal.{axis}"), Unit::URAD_PER_NM, 2.0 * URAD);
        Shape::new(id, vec![parameter("x"), parameter("y")], |at, emit| {
            let moment = at.posture.frame(0).components(&at.loads.moment[0]);
            emit(0, Site::flex(0, Axis6::Rx), moment.x);
            emit(1, Site::flex(0, Axis6::Ry), moment.y);
        })
        .needs(&[Needs::Masses])
        .built()
    },
};
