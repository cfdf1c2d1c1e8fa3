//! `base_wander`: base and instrument wander apart, `base += sum_k (x_k, y_k, z_k) sin((k - 1/2) pi t)` in the world, k = 1 to 8, t
//! being time as a share of the session.
//!
//! These are the first functions of Karhunen and Loève's series of a random walk, whose coefficients are independent with a
//! standard deviation of sqrt(2) s / ((k - 1/2) pi), s being that of the walk at the end of the session. Eight hold 97 % of its
//! variance; what is faster is left to the noise.

use std::f64::consts::{PI, SQRT_2};

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::robot::sites::{Axis6, Site};
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "base_wander",
    arguments: "",
    name: "wander of the base against the instrument",
    what: "base and instrument wander apart without a direction",
    equation: "base += sum (x, y, z)_k sin((k - 1/2) pi t), k = 1..8",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::World, Follows::Time],
    role: Role::Event,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "base and instrument wander apart in the course of the session",
        intervention: Intervention {
            work: Work::Instrument,
            act: "check the stand of the instrument, draughts and sunlight; measure a fixed point between the poses",
            verify: "the fixed point stays within the noise for an hour",
        },
    },
    signature: Signature {
        looks: [
            "All residuals of a quarter of an hour point the same way in the room, and those of the next another way.",
            "Over time the points of a room axis follow a slow line that goes up and down.",
            "Posture and load do not change it.",
        ],
        parted_by: "A fixed point measured between the poses: it wanders alike. A bump is a step, a warm-up a curve that comes to rest.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let of =
            |k: usize| ["x", "y", "z"].map(|axis| ParameterSpec::new(format!("base_wander.{axis}{k}"), Unit::MM, plausible(k)));
        Shape::new(id, (1..=ORDERS).flat_map(of).collect(), |at, emit| {
            if let Some(t) = at.share_of_session() {
                for k in 1..=ORDERS {
                    let weight = (rate(k) * t).sin();
                    (0..3).for_each(|axis| emit(3 * (k - 1) + axis, Site::Base(Axis6::ALL[axis]), weight));
                }
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Time])
        .built()
    },
};

/// Number of functions of the series.
const ORDERS: usize = 8;

/// Plausible walk at the end of the session (1 sigma), m.
const WALK: f64 = 0.05 * MM;

/// Rate of function `k` per session, rad.
fn rate(k: usize) -> f64 {
    (k as f64 - 0.5) * PI
}

/// Plausible size (1 sigma) of coefficient `k`, m.
fn plausible(k: usize) -> f64 {
    SQRT_2 * WALK / rate(k)
}
