//! `target:R`: a measured point of the tool is not where it was said to be relative to the TCP. Three parameters, tool axes.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::by_name;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{Shape, shift_tool};
use crate::effects::{EffectId, Owner, ParameterSpec};
use crate::units::{MM, Unit};

impl EffectId {
    /// The position of a target on the tool, which a dataset states.
    pub const TARGET: &str = "target";

    /// The position of this target.
    pub fn of_target(name: &str) -> Self {
        EffectId::member(EffectId::TARGET, name)
    }
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::TARGET,
    arguments: ":R",
    name: "position of target {name} on the tool",
    what: "a target is not where it is stated to be on the tool",
    equation: "tool += (x, y, z) in tool axes, at samples of target R",
    origin: Origin::Gauge,
    scan: Scan::None,
    follows: &[Follows::Tool],
    role: Role::Cause,
    offered: Offered::ByName,
    physical: Physical::Any,
    linear_range: LinearRange::Unlimited,
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "one measured point of the tool is not where it is stated to be",
        intervention: Intervention {
            work: Work::Artifact,
            act: "look at the seat of that target; measure its place on the tool again",
            verify: "the target taken off and set again ten times stays",
        },
    },
    signature: Signature {
        looks: [
            "All samples of one target are off by the same amount in the axes of the tool, those of the others are right.",
            "In the axes of the room it turns with the hand.",
            "It does not change with load or time.",
        ],
        parted_by: "The target measured on its plate by another instrument, or with the hand turned.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: by_name,
    build: |id, _| {
        let tool_target = id.rest().filter(|r| !r.is_empty()).ok_or_else(|| id.wrong("names a target after the colon"))?;
        let tool_target = tool_target.to_owned();
        Shape::new(id, ParameterSpec::xyz(id.whole(), Unit::MM, 0.03 * MM), move |at, emit| {
            if at.tool_target == Some(tool_target.as_str()) {
                (0..3).for_each(|k| shift_tool(k, &at.tool_axis(k), emit));
            }
        })
        // The tool is the same body in every session of a dataset.
        .owner(Owner::Artifact)
        .built()
    },
};
