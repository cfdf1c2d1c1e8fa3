//! `gauge_gain:I`: an indicator reads low by a share, `tool += g r_I e_I`; visible if residual readings remain.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::each_indicator;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{Shape, shift_tool};
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "gauge_gain",
    arguments: ":I",
    name: "scale of {indicator}",
    what: "an indicator's scale is off",
    equation: "tool += g r_I e_I",
    origin: Origin::Gauge,
    scan: Scan::None,
    follows: &[Follows::Reading],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.1),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "an indicator shows a share too much or too little",
        intervention: Intervention {
            work: Work::Instrument,
            act: "check the scale of that indicator with a gauge block",
            verify: "the indicator shows the thickness of the block",
        },
    },
    signature: Signature {
        looks: [
            "The samples that ended farthest from zero on one indicator are off the most.",
            "Against that indicator's reading the points lie on a line through zero.",
            "A centring that ends at zero does not show it at all.",
        ],
        parted_by: "A few probings that are stopped on purpose at readings of some tenths of a millimetre, and the columns r1_um ... that record them.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: each_indicator,
    build: |id, _| {
        let i = id.indicator()?;
        Shape::new(id, vec![ParameterSpec::new(format!("{}.g", id.whole()), Unit::RATIO, 1e-3)], move |at, emit| {
            if let (Some(_), Some(reading)) = (at.ball(), at.reading) {
                shift_tool(0, &(at.tool_axis(i) * reading[i]), emit);
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Readings])
        .built()
    },
};
