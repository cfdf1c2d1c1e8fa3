//! `ball:B`: a ball of the artifact moved or was mis-measured. Three numbers, in the world.

use super::family::each_ball;
use super::shape::Shape;
use super::{Family, Needs, Origin, Owner, ParameterSpec, Scan};
use crate::robot::Site;
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "ball",
    arguments: ":B",
    what: "a ball moved or was mis-measured",
    equation: "ball_B += (x, y, z)",
    origin: Origin::Artifact,
    scan: Scan::None,
    members: each_ball,
    build: |id, subject| {
        let name = id.arguments.join(":");
        let unknown = || id.wrong(format!("names a ball after the colon, one of: {}", subject.balls.join(", ")));
        let ball = subject.balls.iter().position(|b| *b == name).ok_or_else(unknown)?;
        Shape::new(id, ParameterSpec::xyz(id.whole, Unit::MM, 0.04 * MM), move |at, emit| {
            if at.ball() == Some(ball) {
                (0..3).for_each(|k| emit(k, Site::target(k), 1.0));
            }
        })
        .owner(Owner::Artifact)
        .needs(&[Needs::Balls])
        .built()
    },
};
