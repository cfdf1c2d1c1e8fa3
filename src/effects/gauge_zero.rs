//! `gauge_zero:I`: an indicator was not zero when the ball was centred, `tool += z e_I` where a ball is probed.

use super::family::each_indicator;
use super::shape::{Shape, shift_tool};
use super::{Family, Needs, Origin, Owner, ParameterSpec, Scan};
use crate::units::{UM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "gauge_zero",
    arguments: ":I",
    what: "an indicator's zero is off",
    equation: "tool += z e_I, on balls",
    origin: Origin::Gauge,
    scan: Scan::None,
    members: each_indicator,
    build: |id, _| {
        let i = id.indicator()?;
        Shape::new(id, vec![ParameterSpec::new(format!("{}.z", id.whole), Unit::UM, 3.0 * UM)], move |at, emit| {
            if at.ball().is_some() {
                shift_tool(0, &at.indicator(i), emit);
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Balls])
        .built()
    },
};
