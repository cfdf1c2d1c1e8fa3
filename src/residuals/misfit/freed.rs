//! Slips of any size: zeros, scales, lengths and constants that are fitted together with the frames.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::campaign::{Campaign, Seen};
use super::frames::{FrameFit, Frames, NU, flanges, scale};
use super::slip::{Along, Slip};
use super::starts::fit;
use crate::math::positive_definite::cholesky;
use crate::robot::JointKind;
use crate::units::DEG;

/// Step of the derivatives, rad, m or one.
const STEP: f64 = 1e-6;
/// Largest number of steps of a fit.
const STEPS: usize = 20;
/// A fit ends when its cost falls by less than this share.
const AT_REST: f64 = 1e-6;
/// Step between the zeros from which a fit starts, rad.
const BETWEEN_STARTS: f64 = 30.0 * DEG;
/// Scales of a joint from which a fit starts: gon, another gear, half a turn written as a whole one.
const SCALES: [f64; 8] = [0.9, 1.0 / 0.9, 0.5, 2.0, -0.5, -2.0, 0.7, 1.4];
/// Number of times that the zeros of all joints are searched one after the other.
const ROUNDS: usize = 3;

/// The slip of these sizes, SI.
type OfSizes = Box<dyn Fn(&[f64]) -> Slip + Send + Sync>;

/// Slips that differ in the size of what is fitted.
pub(super) struct Family {
    /// Sizes from which a fit starts, SI.
    starts: Vec<Vec<f64>>,
    slip: OfSizes,
}

impl Family {
    fn new(starts: Vec<Vec<f64>>, slip: impl Fn(&[f64]) -> Slip + Send + Sync + 'static) -> Self {
        Family { starts, slip: Box::new(slip) }
    }

    /// All that may have occurred in these data.
    pub fn all(campaign: &Campaign) -> Vec<Family> {
        let robot = &campaign.robot;
        let mut all = Family::of_the_measurement(campaign);
        for (j, kind) in robot.kinds().enumerate() {
            let turns = kind == JointKind::Revolute;
            let zeros = |first: i32| {
                let last = if turns { first + 12 } else { 1 };
                (first..last).map(|k| vec![f64::from(k) * BETWEEN_STARTS]).collect::<Vec<_>>()
            };
            all.push(Family::new(zeros(-5), move |p| Slip::JointScale(j, [1.0, within_a_turn(p[0], turns)])));
            all.push(Family::new(zeros(-6), move |p| Slip::JointScale(j, [-1.0, within_a_turn(p[0], turns)])));
            if !turns {
                let scales = scales_of_slide(campaign, j).map(|by| vec![by]).to_vec();
                all.push(Family::new(scales, move |p| Slip::JointScale(j, [p[0], 0.0])));
            }
            // Of a first joint that slides, the base has the zero.
            if turns || j > 0 {
                let scales = SCALES.map(|by| vec![by, 0.0]).to_vec();
                all.push(Family::new(scales, move |p| Slip::JointScale(j, [p[0], within_a_turn(p[1], turns)])));
            }
            // Of the first and the last link, base and tool have the lengths.
            if j > 0 {
                all.push(Family::new(vec![vec![0.0]], move |p| Slip::Length(j, Along::X, p[0])));
            }
            if j > 0 && j + 1 < robot.joints() {
                all.push(Family::new(vec![vec![0.0]], move |p| Slip::Length(j, Along::Z, p[0])));
            }
        }
        all
    }

    /// Those of the measurement alone.
    pub fn of_the_measurement(campaign: &Campaign) -> Vec<Family> {
        let mut all = Vec::new();
        if campaign.has_points() {
            all.push(Family::new(vec![vec![1.0]], |p| Slip::PointScale(p[0])));
        }
        if campaign.shots.iter().any(|s| matches!(s.seen, Seen::Distance { .. })) {
            all.push(Family::new(vec![vec![1.0]], |p| Slip::DistanceScale(p[0])));
            all.push(Family::new(vec![vec![0.0]], |p| Slip::DistanceConstant(p[0])));
        }
        all
    }

    /// The slip whose size fits best.
    pub fn fitted(&self, campaign: &Campaign) -> Slip {
        let left = |start: &Vec<f64>| fit(&(self.slip)(start).undone(campaign)).robust;
        let best = self.starts.iter().min_by(|a, b| left(a).total_cmp(&left(b)));
        let start = best.cloned().unwrap_or_default();
        (self.slip)(&refined(campaign, &*self.slip, start))
    }
}

/// Scales from which the fit of a joint that slides starts: whatever it counts in, it slid over some part of its range.
fn scales_of_slide(campaign: &Campaign, joint: usize) -> [f64; 8] {
    let counted = campaign.shots.iter().map(|shot| shot.q[joint]);
    let least = counted.clone().fold(f64::INFINITY, f64::min);
    let over = (counted.fold(f64::NEG_INFINITY, f64::max) - least).max(f64::MIN_POSITIVE);
    let [low, high] = campaign.robot.links[joint].limits;
    let range = if (high - low).is_finite() { high - low } else { 1.0 };
    [1.0, 0.5, 0.2, 0.05, -1.0, -0.5, -0.2, -0.05].map(|part| part * range / over)
}

/// Zeros of all joints, then signs and zeros, then scales and zeros; each starts from the best values of one joint after the
/// other.
pub(super) fn all_joints(campaign: &Campaign) -> Vec<Slip> {
    let n = campaign.robot.joints();
    let kinds: Vec<JointKind> = campaign.robot.kinds().collect();
    let turns = |j: usize| kinds[j] == JointKind::Revolute;
    let zeros = |all: &[[f64; 2]]| -> Vec<f64> { all.iter().map(|[_, zero]| *zero).collect() };
    let mut found = Vec::new();
    for signs in [&[1.0][..], &[1.0, -1.0]] {
        let start = one_after_the_other(campaign, signs);
        let signs: Vec<f64> = start.iter().map(|[sign, _]| *sign).collect();
        let all = {
            let (signs, kinds) = (signs.clone(), kinds.clone());
            move |p: &[f64]| {
                let one = |j: usize| [signs[j], within_a_turn(p[j], kinds[j] == JointKind::Revolute)];
                Slip::JointScales((0..signs.len()).map(one).collect())
            }
        };
        let at = refined(campaign, &all, zeros(&start));
        found.push(all(&at));
        let scaled = |p: &[f64]| Slip::JointScales((0..n).map(|j| [p[n + j], within_a_turn(p[j], turns(j))]).collect());
        for spread in [1.0, 0.7, 1.4] {
            let start: Vec<f64> = at.iter().copied().chain(signs.iter().map(|s| s * spread)).collect();
            found.push(scaled(&refined(campaign, &scaled, start)));
        }
    }
    found
}

/// Sign and zero of each joint with the smallest residual while the others stay, from the first joint to the last, several
/// times.
fn one_after_the_other(campaign: &Campaign, signs: &[f64]) -> Vec<[f64; 2]> {
    let mut all = vec![[1.0, 0.0]; campaign.robot.joints()];
    let left = |all: &Vec<[f64; 2]>| fit(&Slip::JointScales(all.clone()).undone(campaign)).robust;
    let mut least = left(&all);
    for _ in 0..ROUNDS {
        let before = least;
        for j in (0..all.len()).filter(|&j| campaign.robot.kind(j) == JointKind::Revolute) {
            let tries: Vec<[f64; 2]> =
                signs.iter().flat_map(|sign| (-12..12).map(move |k| [*sign, f64::from(k) * 0.5 * BETWEEN_STARTS])).collect();
            let one = |at: &[f64; 2]| {
                let mut all = all.clone();
                all[j] = *at;
                (left(&all), *at)
            };
            let best = tries.par_iter().map(one).min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((residual, at)) = best.filter(|(residual, _)| *residual < least) {
                (least, all[j]) = (residual, at);
            }
        }
        if least >= before {
            break;
        }
    }
    all
}

/// The same angle between -180 and 180 deg.
fn within_a_turn(angle: f64, turns: bool) -> f64 {
    if turns { angle - (angle / std::f64::consts::TAU).round() * std::f64::consts::TAU } else { angle }
}

/// Sizes at which the data fit best, by Levenberg and Marquardt over sizes and frames together, with the weights of a
/// t distribution.
fn refined(campaign: &Campaign, slip: &dyn Fn(&[f64]) -> Slip, start: Vec<f64>) -> Vec<f64> {
    let mut sizes = start;
    let mut changed = slip(&sizes).undone(campaign);
    let mut frames = fit(&changed).frames;
    let mut damping = 1e-6;
    for _ in 0..STEPS {
        let misses = misses(&changed, &frames);
        let variance = scale(&misses);
        let cost = |misses: &[f64]| misses.iter().map(|d| (d * d / (NU * variance)).ln_1p()).sum::<f64>();
        let before = cost(&misses);
        let weights: Vec<f64> = misses.iter().map(|d| (NU + 3.0) / (NU + d * d / variance)).collect();
        let Some((normal, right)) = normal_equations(campaign, slip, &sizes, &changed, &frames, &weights) else { break };
        let mut better = None;
        for _ in 0..6 {
            let mut damped = normal.clone();
            let size = damped.diagonal().max().max(f64::MIN_POSITIVE);
            for k in 0..damped.nrows() {
                damped[(k, k)] = damped[(k, k)] * (1.0 + damping) + 1e-13 * size;
            }
            let Ok(step) = cholesky(damped).map(|factor| factor.solve(&right)) else { break };
            let own = flanges(&changed.robot, &changed);
            let moved = FrameFit::new(&changed, &own).moved(&frames, &step);
            let first = step.len() - sizes.len();
            let next: Vec<f64> = sizes.iter().enumerate().map(|(k, p)| p + step[first + k]).collect();
            let other = slip(&next).undone(campaign);
            let after = cost(&self::misses(&other, &moved));
            if after < before {
                damping = (damping * 0.1).max(1e-12);
                better = Some((next, other, moved, after));
                break;
            }
            damping = (damping * 30.0).max(1e-6);
        }
        let Some((next, other, moved, after)) = better else { break };
        (sizes, changed, frames) = (next, other, moved);
        if before - after <= AT_REST * before {
            break;
        }
    }
    sizes
}

fn misses(campaign: &Campaign, frames: &Frames) -> Vec<f64> {
    super::frames::misses(campaign, frames)
}

/// Normal matrix and right side of the unknown frames, then of the sizes; `None` if a number is not finite.
fn normal_equations(
    campaign: &Campaign,
    slip: &dyn Fn(&[f64]) -> Slip,
    sizes: &[f64],
    changed: &Campaign,
    frames: &Frames,
    weights: &[f64],
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let own = flanges(&changed.robot, changed);
    let here = FrameFit::new(changed, &own);
    let (rows, unknowns) = (weights.len(), here.unknowns());
    let mut columns = DMatrix::<f64>::zeros(3 * rows, unknowns + sizes.len());
    let mut residuals = DVector::<f64>::zeros(3 * rows);
    for (k, weight) in weights.iter().map(|w| w.sqrt()).enumerate() {
        let row = here.row(k, frames);
        residuals.fixed_rows_mut::<3>(3 * k).copy_from(&(row.residual * weight));
        for (at, block) in &row.blocks[..row.used] {
            columns.fixed_view_mut::<3, 3>(3 * k, *at).copy_from(&(block * weight));
        }
    }
    for p in 0..sizes.len() {
        let mut more = sizes.to_vec();
        more[p] += STEP;
        let beside = slip(&more).undone(campaign);
        let own = flanges(&beside.robot, &beside);
        let there = FrameFit::new(&beside, &own);
        for (k, weight) in weights.iter().map(|w| w.sqrt()).enumerate() {
            let change = (here.row(k, frames).residual - there.row(k, frames).residual) * (weight / STEP);
            columns.fixed_view_mut::<3, 1>(3 * k, unknowns + p).copy_from(&change);
        }
    }
    let all = columns.iter().chain(residuals.iter()).all(|x| x.is_finite());
    all.then(|| (columns.tr_mul(&columns), columns.tr_mul(&residuals)))
}
