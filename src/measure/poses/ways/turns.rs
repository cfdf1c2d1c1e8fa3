//! Whole turns: joint angles that show the same posture.

use std::f64::consts::TAU;

use super::polyline::turn;
use crate::robot::{JointKind, Robot};

/// Most joint angles returned: each may cost a search.
const OFFERED: usize = 6;

/// Joint angles (rad, N) inside the limits that differ from `to` by one whole turn of one or two revolute joints, those nearest
/// to `from` first.
pub(super) fn turned(robot: &Robot, from: &[f64], to: &[f64]) -> Vec<Vec<f64>> {
    let one = |q: &[f64]| -> Vec<Vec<f64>> {
        let joints = robot.links.iter().enumerate().filter(|(_, link)| link.mdh.kind == JointKind::Revolute);
        joints
            .flat_map(|(j, link)| [q[j] - TAU, q[j] + TAU].map(|angle| (j, link.limits, angle)))
            .filter(|&(_, [low, high], angle)| (low..=high).contains(&angle))
            .map(|(j, _, angle)| {
                let mut turned = q.to_vec();
                turned[j] = angle;
                turned
            })
            .collect()
    };
    let mut found = one(to);
    found.extend(found.clone().iter().flat_map(|q| one(q)));
    found.sort_by(|a, b| turn(from, a).total_cmp(&turn(from, b)));
    found.dedup();
    found.retain(|q| q != to);
    found.truncate(OFFERED);
    found
}
