//! `gauge_zero:I`: an indicator was not zero when the ball was centred, `tool += z e_I` where a ball is probed.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::each_indicator;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{Shape, shift_tool};
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::units::{UM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "gauge_zero",
    arguments: ":I",
    name: "zero of {indicator}",
    what: "an indicator's zero is off",
    equation: "tool += z e_I, on balls",
    origin: Origin::Gauge,
    scan: Scan::None,
    follows: &[Follows::Tool],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-4),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "an indicator's zero is not where mastering put it",
        intervention: Intervention {
            work: Work::Instrument,
            act: "master the gauge again",
            verify: "two masterings in a row differ by less than the noise",
        },
    },
    signature: Signature {
        looks: [
            "Every ball is missed by the same small amount along one indicator.",
            "In the axes of the tool it is one constant number; the fit takes it for a wrong TCP.",
            "It appears only on balls, never on points of a tracker.",
        ],
        parted_by: "A second mastering, or points by another instrument on the same tool.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: each_indicator,
    build: |id, _| {
        let i = id.indicator()?;
        Shape::new(id, vec![ParameterSpec::new(format!("{}.z", id.whole()), Unit::UM, 3.0 * UM)], move |at, emit| {
            if at.ball().is_some() {
                shift_tool(0, &at.tool_axis(i), emit);
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Balls])
        .built()
    },
};
