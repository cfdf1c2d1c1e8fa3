//! `tool_looseness`: the tool rocks in its changer to the side to which gravity pulls it, `tool += (x, y, z)_k tanh(g_k / g_0)`,
//! g_k being the direction of gravity along axis k of the last frame.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "tool_looseness",
    arguments: "",
    name: "play of the tool in its changer",
    what: "the tool is loose and falls to the side of gravity",
    equation: "tool += (x, y, z)_k tanh(g_k / g_0)",
    origin: Origin::Gauge,
    scan: Scan::None,
    follows: &[Follows::Load, Follows::Tool],
    role: Role::Event,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the tool rocks on the flange to the side to which gravity pulls it",
        intervention: Intervention {
            work: Work::Tool,
            act: "tighten the tool, and clean the seat of its changer",
            verify: "an indicator at the TCP while the hand turns over: it comes back",
        },
    },
    signature: Signature {
        looks: [
            "In the axes of the tool the points form two groups, one for each side to which the tool can fall.",
            "Against the direction of gravity along an axis of the tool they form two level shelves with a steep step at zero.",
            "Neither the reach of the arm nor the payload changes its size.",
        ],
        parted_by: "The hand turned half a turn about a level axis, on the same point; a dial indicator between tool and flange settles it.",
    },
    stray: Stray::Closing(2.0),
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameters = ["x", "y", "z"].map(|axis| ParameterSpec::new(format!("tool_looseness.{axis}"), Unit::MM, 0.05 * MM));
        Shape::new(id, parameters.to_vec(), |at, emit| {
            let down = at.gravity_in_last_frame();
            (0..3).for_each(|k| emit(k, Site::tool(k), (down[k] / CLOSING).tanh()));
        })
        .owner(Owner::Session)
        .built()
    },
};

/// g_0, as a share of gravity: dry steel holds a tool in its seat by friction against no more than a fifth of its weight.
const CLOSING: f64 = 0.2;
