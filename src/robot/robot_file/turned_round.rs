//! A joint that counts the other way, as one that does not: its axis is turned round, and the next row turns it back.
//!
//! With `X = Rx(pi)`, which is its own inverse, `Rz(-phi) = X Rz(phi) X`, `Tz(-s) = X Tz(s) X` and `Ry(beta) X = X Ry(-beta)`, so
//! `Rx(alpha) Tx(a) Ry(beta) Rz(theta - q) Tz(d) = Rx(alpha + pi) Tx(a) Ry(-beta) Rz(q - theta) Tz(-d) X`.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use crate::robot::solids::Shape;
use crate::robot::{FramePose, Robot};

/// Makes joint `i` (counted from 0) of a robot count the other way, everything else staying where it is at the same posture.
pub(super) fn turn_round(robot: &mut Robot, i: usize) {
    let link = &mut robot.links[i];
    let mdh = &mut link.mdh;
    mdh.alpha = half_a_turn_on(mdh.alpha);
    (mdh.beta, mdh.theta, mdh.d) = (-mdh.beta, -mdh.theta, -mdh.d);
    link.com = turned(&link.com);
    for solid in robot.solids.iter_mut().filter(|solid| solid.frame == i + 1) {
        match &mut solid.shape {
            Shape::Capsule { ends, .. } => *ends = ends.map(|end| turned(&end)),
            // Its sides stay parallel to the axes.
            Shape::Box { centre, .. } => *centre = turned(centre),
        }
    }
    match robot.links.get_mut(i + 1) {
        Some(next) => next.mdh.alpha = half_a_turn_on(next.mdh.alpha),
        None => {
            let back = FramePose { rz_ry_rx: [0.0, 0.0, PI], ..FramePose::default() };
            robot.flange = back.then(&robot.flange);
        }
    }
}

/// Rx(pi) applied to a vector.
fn turned(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, -v.y, -v.z)
}

/// The angle half a turn on, in (-pi, pi].
fn half_a_turn_on(angle: f64) -> f64 {
    let on = angle + PI;
    if on > PI { on - TAU } else { on }
}
