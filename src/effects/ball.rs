//! `ball:B`: a ball of the artifact moved or was mis-measured. Three parameters, in the world.

use super::family::each_ball;
use super::shape::Shape;
use super::{
    Family, Follows, LinearRange, Meaning, Needs, Offered, Origin, Owner, ParameterSpec, Period, Physical, Role, Scan, Stray,
};
use crate::robot::Site;
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "ball",
    arguments: ":B",
    name: "position of ball {name}",
    what: "a ball moved or was mis-measured",
    equation: "ball_B += (x, y, z)",
    origin: Origin::Artifact,
    scan: Scan::None,
    follows: &[Follows::Ball],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.1),
    period: Period::None,
    meaning: Meaning {
        physics: "one ball is not where it was certified to be",
        look: "look at that ball: dirt, a loose seat, a damaged thread; measure it again",
    },
    stray: Stray::None,
    members: each_ball,
    build: |id, subject| {
        let ball = id.ball(subject)?;
        Shape::new(id, ParameterSpec::xyz(id.whole(), Unit::MM, 0.04 * MM), move |at, emit| {
            if at.ball() == Some(ball) {
                (0..3).for_each(|k| emit(k, Site::target(k), 1.0));
            }
        })
        .owner(Owner::Artifact)
        .needs(&[Needs::Balls])
        .built()
    },
};
