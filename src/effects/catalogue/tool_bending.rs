//! `tool_bending`: the tool gives way to its own weight, `tool += (x g_x, y g_y)`, g_k being the direction of gravity along axis k
//! of the last frame. Along z it is stiff; a tool that gave way alike in all directions would be a base that is too low.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
    Unphysical, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "tool_bending",
    arguments: "",
    name: "bending of the tool",
    what: "the tool sags under its own weight",
    equation: "tool += (x g_x, y g_y)",
    origin: Origin::Gauge,
    scan: Scan::None,
    follows: &[Follows::Load, Follows::Tool],
    role: Role::Event,
    offered: Offered::Always,
    physical: Physical::AtLeast(0.0, Unphysical::NegativeCompliance),
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the tool bends under its own weight",
        intervention: Intervention {
            work: Work::Tool,
            act: "stiffen the tool or its bracket",
            verify: "an indicator at the TCP while the hand turns over",
        },
    },
    signature: Signature {
        looks: [
            "In the axes of the tool every residual points to where gravity pulls.",
            "Against the direction of gravity along an axis of the tool the points follow a straight line through zero.",
            "It does not grow with the reach of the arm, and a payload on the flange leaves it as it is.",
        ],
        parted_by: "The hand turned about a level axis, on the same point, with a payload and without: joints give way to the payload too, the tool does not.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameters = ["x", "y"].map(|axis| ParameterSpec::new(format!("tool_bending.{axis}"), Unit::MM, 0.03 * MM));
        Shape::new(id, parameters.to_vec(), |at, emit| {
            let down = at.gravity_in_last_frame();
            (0..2).for_each(|k| emit(k, Site::tool(k), down[k]));
        })
        .owner(Owner::Session)
        .built()
    },
};
