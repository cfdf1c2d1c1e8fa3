//! `instrument_scale`: the instrument that measures points is off in scale, `point += s point` in the world. One parameter.
//!
//! Where all lengths of the arm and its tool are free, they can take its place: it is a user who knows that the arm's lengths are
//! as drawn, or tool and base as measured, who adds it.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::situation::Kind;
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{UM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "instrument_scale",
    arguments: "",
    name: "scale of the instrument",
    what: "a tracker or camera measures all lengths too long or too short",
    equation: "point += s p",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::Point],
    role: Role::Event,
    offered: Offered::ByName,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.1),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the instrument measures all lengths too long or too short by one share",
        intervention: Intervention {
            work: Work::Instrument,
            act: "measure a bar of known length; check the focal length of a camera, the air temperature entered in a tracker",
            verify: "the bar has its length",
        },
    },
    signature: Signature {
        looks: [
            "The measured places are spread too far, or not far enough, about one point.",
            "The error grows with the distance from the middle of the measured places, in the direction away from it.",
            "A fit of the arm takes it as links that are all too long by the same share.",
        ],
        parted_by: "A bar of known length, measured where the robot works; balls beside the points settle it, too.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameter = ParameterSpec::new("instrument_scale.s", Unit::UM_PER_M, 1000.0 * UM);
        Shape::new(id, vec![parameter], |at, emit| {
            if let (Some(Kind::Point), Some(point)) = (at.kind, at.target) {
                (0..3).for_each(|k| emit(0, Site::target(k), point[k]));
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Points])
        .built()
    },
};
