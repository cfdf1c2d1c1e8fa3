//! `gauge_tilt:I`: a plunger's flat is tilted and responds to the ball's offset across it: `tool += k (r_J + r_K) e_I`, J
//! and K being the other two indicators. The tilt about the other direction appears in their difference and is omitted.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::each_indicator;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{Shape, shift_tool};
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::units::{MRAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "gauge_tilt",
    arguments: ":I",
    name: "tilted flat of {indicator}",
    what: "a plunger's flat is tilted",
    equation: "tool += k (r_J + r_K) e_I",
    origin: Origin::Gauge,
    scan: Scan::None,
    follows: &[Follows::Reading],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.05),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "a plunger's flat is not square to its travel",
        intervention: Intervention {
            work: Work::Instrument,
            act: "check that the flat of that plunger is square to its travel",
            verify: "push a neighbouring plunger by 1 mm: this indicator stays",
        },
    },
    signature: Signature {
        looks: [
            "One indicator errs when the other two are off their zeros.",
            "Against the sum of the other two readings the points lie on a line through zero.",
            "A centring that ends at zero does not show it at all.",
        ],
        parted_by: "A few probings that are stopped on purpose away from zero, one indicator at a time.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: each_indicator,
    build: |id, _| {
        let i = id.indicator()?;
        Shape::new(id, vec![ParameterSpec::new(format!("{}.k", id.whole()), Unit::MRAD, MRAD)], move |at, emit| {
            if let (Some(_), Some(reading)) = (at.ball(), at.reading) {
                shift_tool(0, &(at.tool_axis(i) * (reading.sum() - reading[i])), emit);
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Readings])
        .built()
    },
};
