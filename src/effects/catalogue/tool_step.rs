//! `tool_step:T`: the TriCal moved on the flange once, T seconds into the session: `tool += (x, y, z)` after T, in the last frame.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{EffectId, Needs, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{MM, Unit};

impl EffectId {
    /// The tool that moved on the flange.
    pub const TOOL_STEP: &str = "tool_step";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::TOOL_STEP,
    arguments: ":T",
    name: "tool moved on the flange {time}",
    what: "the tool moved on the flange once",
    equation: "tool += (x, y, z) after T",
    origin: Origin::Gauge,
    scan: Scan::Time,
    follows: &[Follows::Tool, Follows::Time],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.02),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the tool moved on the flange once",
        intervention: Intervention {
            work: Work::Tool,
            act: "tighten the bolts between flange and tool, look at its pins, master the gauge if it carries one; then measure the tool again",
            verify: "the tool turned about its tip: the tip stays",
        },
    },
    signature: Signature {
        looks: [
            "Up to a certain sample all is well; from then on the tool is off by the same amount in its own axes.",
            "Over time the points of a tool axis lie on two level shelves.",
            "In the axes of the room the second shelf is smeared.",
        ],
        parted_by: "The same point with the hand turned, before and after: a moved tool turns with the hand, a moved base does not.",
    },
    stray: Stray::Moment,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        let time = id.time(0)?;
        Shape::new(id, ParameterSpec::xyz(id.whole(), Unit::MM, 0.1 * MM), move |at, emit| {
            if at.is_after(time) {
                (0..3).for_each(|k| emit(k, Site::tool(k), 1.0));
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Time])
        .built()
    },
};
