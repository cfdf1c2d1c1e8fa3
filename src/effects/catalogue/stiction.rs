//! `stiction`: a plunger sticks on the side it came from, `tool += s_I plunger_I e_I` where a ball is probed. One parameter
//! per indicator.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{Shape, shift_tool};
use crate::effects::{EffectId, Needs, Owner, ParameterSpec};
use crate::units::{UM, Unit};

impl EffectId {
    /// Plungers that stick.
    pub const STICTION: &str = "stiction";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::STICTION,
    arguments: "",
    name: "stiction of the plungers",
    what: "plungers hang up on one side",
    equation: "tool += s_I plunger_I e_I, on balls",
    origin: Origin::Gauge,
    scan: Scan::None,
    follows: &[Follows::Plunger],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-5),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "a plunger hangs up on the side from which it came",
        intervention: Intervention {
            work: Work::Instrument,
            act: "clean that plunger, and approach from one side",
            verify: "the plunger pressed and released ten times comes back to the same reading",
        },
    },
    signature: Signature {
        looks: [
            "The reading of an indicator depends on whether its plunger came in or out.",
            "Against the side of the plunger the points of a tool axis form two clouds.",
            "Each cloud is as tight as the noise.",
        ],
        parted_by: "The same ball approached so that each plunger comes once from either side (plunger1 ...).",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameters = (1..=3).map(|i| ParameterSpec::new(format!("stiction.{i}"), Unit::UM, 3.0 * UM)).collect();
        Shape::new(id, parameters, |at, emit| {
            if let (Some(_), Some(sides)) = (at.ball(), at.plungers) {
                for (i, side) in sides.into_iter().enumerate() {
                    shift_tool(i, &(at.tool_axis(i) * f64::from(side)), emit);
                }
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Plungers])
        .built()
    },
};
