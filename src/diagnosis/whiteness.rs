//! Order in a residual: does it follow anything that is known of the samples? A residual that does is not noise, whatever its size.
//!
//! The residual is tested against every joint angle, the tool's axes, gravity in the tool, the load, the time and the previous
//! posture, each by Fisher's F test of what the columns explain against what they leave, so that the size of the noise does not
//! matter. With n tests the smallest probability counts n times (Bonferroni).

use std::borrow::Cow;

use nalgebra::{DMatrix, Vector3, Vector6};
use rayon::prelude::*;

use super::background::Background;
use super::evidence::Seen;
use super::examination::{Examination, STATED_NOISE_DOF};
use super::sweep::{self, Sweep};
use crate::residuals::noise_floor::fisher_chance;
use crate::robot::kinematics::world_from_tool;
use crate::robot::{FramePose, JointKind};

/// Highest order per turn of a joint.
const ORDERS: usize = 3;

/// Highest order of a wave over the whole session.
const WAVES: usize = 4;

/// Something that the residual may follow: its numbers at every sample, samples x features.
type Features = DMatrix<f64>;

/// Probability that noise shows as much order as the residual; `None` if nothing can be tested.
pub(crate) fn whiteness(examination: &Examination, background: &Background) -> Option<f64> {
    let contexts = &examination.contexts;
    let robot = examination.problem.robot();
    let turning: Vec<usize> = (0..robot.joints()).filter(|&j| robot.kind(j) == JointKind::Revolute).collect();
    let everywhere = [sweep::tool(contexts), sweep::base(contexts)];
    let of_joint: Vec<Vec<Vec<Vector6<f64>>>> = turning.iter().map(|&j| sweep::joint(contexts, j)).collect();
    let (angles, others) = (angles(examination, &turning), others(examination));
    let mut tests: Vec<(&[Vec<Vector6<f64>>], &Features)> = Vec::new();
    for features in angles.iter().chain(&others) {
        tests.extend(everywhere.iter().chain(&of_joint).map(|carriers| (&carriers[..], features)));
    }
    let chance = |(carriers, features): &(&[Vec<Vector6<f64>>], &Features)| {
        let sweep = Sweep::new(examination, background, carriers, Cow::Borrowed(features));
        let block = sweep.block(0, features.ncols(), 1.0);
        let (explained, count) = Seen::new(block.k, &block.z).explained();
        of_share(examination, explained, count)
    };
    let all: Vec<f64> = tests.par_iter().filter_map(chance).collect();
    let least = all.iter().copied().reduce(f64::min)?;
    Some((least * all.len() as f64).min(1.0))
}

/// Probability that `count` columns explain as much of noise; `None` if they leave nothing to compare with.
fn of_share(examination: &Examination, explained: f64, count: usize) -> Option<f64> {
    let prior = if examination.noise_scale.is_known() { STATED_NOISE_DOF } else { 0.0 };
    let (squares, dof) = (examination.remainder.squares - prior, examination.remainder.dof - prior);
    let (above, below) = (count as f64, dof - count as f64);
    if count == 0 || below < above {
        return None;
    }
    let left = (squares - explained).max(f64::MIN_POSITIVE);
    fisher_chance((explained / above) / (left / below), above, below)
}

/// Sines and cosines of each joint's angle.
fn angles(examination: &Examination, turning: &[usize]) -> Vec<Features> {
    let contexts = &examination.contexts;
    let wave = |i: usize, j: usize, k: usize| {
        let x = (k / 2 + 1) as f64 * contexts[i].q[j];
        if k.is_multiple_of(2) { x.sin() } else { x.cos() }
    };
    turning.iter().map(|&j| DMatrix::from_fn(contexts.len(), 2 * ORDERS, |i, k| wave(i, j, k))).collect()
}

/// Gravity in the tool, the load, the time and the previous posture.
fn others(examination: &Examination) -> Vec<Features> {
    let contexts = &examination.contexts;
    let robot = examination.problem.robot();
    let frame = FramePose::default();
    let down: Vec<Vector3<f64>> =
        contexts.iter().map(|at| world_from_tool(robot, &frame, &frame, &at.q).rotation.inverse() * Vector3::z()).collect();
    // Linear and quadratic, without the square of the third, which the others and a constant give.
    let of_gravity = |i: usize, k: usize| {
        let g = down[i];
        [g.x, g.y, g.z, g.x * g.y, g.x * g.z, g.y * g.z, g.x * g.x, g.y * g.y][k]
    };
    let mut all = vec![DMatrix::from_fn(contexts.len(), 8, of_gravity)];
    let joints = robot.joints();
    let of_load = |j: usize| contexts.iter().map(|at| at.tau[j].abs()).fold(f64::MIN_POSITIVE, f64::max);
    if robot.has_masses() {
        let largest: Vec<f64> = (0..joints).map(of_load).collect();
        let loaded: Vec<usize> = (0..joints).filter(|&j| largest[j] > f64::MIN_POSITIVE).collect();
        let of_torque = |i: usize, k: usize| {
            let x = contexts[i].tau[loaded[k / 2]] / largest[loaded[k / 2]];
            if k.is_multiple_of(2) { x } else { x * x.abs() }
        };
        all.push(DMatrix::from_fn(contexts.len(), 2 * loaded.len(), of_torque));
    }
    let order = order(examination);
    let wave = |i: usize, k: usize| ((k + 1) as f64 * std::f64::consts::PI * order[i]).cos();
    all.push(DMatrix::from_fn(contexts.len(), WAVES, wave));
    let mut before: Vec<usize> = (0..contexts.len()).collect();
    before.sort_by(|&a, &b| order[a].total_cmp(&order[b]));
    let mut previous = vec![None; contexts.len()];
    before.windows(2).for_each(|pair| previous[pair[1]] = Some(pair[0]));
    // The side from which each joint came, and how far.
    let of_move = |i: usize, k: usize| {
        previous[i].map_or(0.0, |p: usize| {
            let turned = contexts[i].q[k / 2] - contexts[p].q[k / 2];
            if k.is_multiple_of(2) {
                turned.tanh()
            } else if turned == 0.0 {
                0.0
            } else {
                turned.signum()
            }
        })
    };
    all.push(DMatrix::from_fn(contexts.len(), 2 * joints, of_move));
    all
}

/// Place of each sample in the order of measurement, from 0 to 1: by time where all samples have one, otherwise by row.
fn order(examination: &Examination) -> Vec<f64> {
    let contexts = &examination.contexts;
    let timed = contexts.iter().all(|at| at.time_s.is_some());
    let at = |i: usize| (contexts[i].setup, if timed { contexts[i].time_s.unwrap_or_default() } else { i as f64 });
    let mut places: Vec<usize> = (0..contexts.len()).collect();
    places.sort_by(|&a, &b| at(a).0.cmp(&at(b).0).then(at(a).1.total_cmp(&at(b).1)));
    let mut order = vec![0.0; contexts.len()];
    places.iter().enumerate().for_each(|(k, &i)| order[i] = k as f64 / contexts.len().max(2) as f64);
    order
}
