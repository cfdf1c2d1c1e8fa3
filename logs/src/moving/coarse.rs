//! The delay between joints and instrument to milliseconds: that at which the instrument sees a point of the arm's tool.

use calibench::robot::Robot;

use crate::clocks::{DELAY, shifts};
use crate::geometry::{AtRests, Seen, misfit};
use crate::series::Series;
use crate::still_poses::{FOLLOWS, flange_at};

/// Step in which the shifts of one clock are tried, s: within it the fastest arm moves by a tenth of what it reaches.
const FINE: f64 = 0.02;
/// The same where the clocks know nothing of each other.
const COARSE: f64 = 0.05;
/// Most shifts that are tried one by one; in longer recordings those at which both move at the same times.
const MOST: f64 = 8000.0;
/// Moments at which a shift is judged.
const MOMENTS: usize = 120;
/// Smallest share of them that must lie inside the recording of the joints.
const COMMON: f64 = 0.5;
/// Shifts farther apart than this are different ones, s.
const APART: f64 = 0.5;
/// Another shift that leaves less than this multiple leaves it open which is right.
const RIVAL: f64 = 2.0;
/// What the right shift leaves at most of an arm that is not far from its drawing, in parts of how far the point spreads.
const RIGHT: f64 = 0.03;
/// Number of valleys that are looked into.
const VALLEYS: usize = 6;
/// Halvings of a step towards the bottom of a valley.
const HALVINGS: usize = 8;

/// The time to be added to those of the instrument, s; `None` if there is none, or more than one.
pub(super) fn coarse(robot: &Robot, joints: &Series, seen: &Series, has_one_clock: bool) -> Option<f64> {
    let moments = moments(seen);
    let off = |shift: f64| judged(robot, joints, &moments, shift).unwrap_or(f64::INFINITY);
    let ends = |times: &[f64]| times.first().copied().zip(times.last().copied());
    let ((begin, end), (from, to)) = (ends(&joints.times)?, ends(&seen.times)?);
    let (tried, step): (Vec<f64>, f64) = if has_one_clock {
        (grid(-DELAY, DELAY, FINE), FINE)
    } else {
        let shared = COMMON * (end - begin).min(to - from);
        let [first, last] = [begin - to + shared, end - from - shared];
        if (last - first) / COARSE <= MOST {
            (grid(first, last, COARSE), COARSE)
        } else {
            let flange = joints.values.chunks_exact(joints.ranges.len()).flat_map(|q| flange_at(robot, q)).collect();
            let likely = shifts(&Series::new(joints.times.clone(), flange, 3), seen);
            (likely.iter().flat_map(|s| grid(s.seconds - 0.2, s.seconds + 0.2, FINE)).collect(), FINE)
        }
    };
    let mut scores: Vec<[f64; 2]> =
        tried.into_iter().map(|shift| [off(shift), shift]).filter(|[off, _]| off.is_finite()).collect();
    scores.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut valleys: Vec<[f64; 2]> = Vec::new();
    for [score, shift] in scores {
        if valleys.len() < VALLEYS && valleys.iter().all(|other| (other[1] - shift).abs() > APART) {
            valleys.push([score, shift]);
        }
    }
    let mut bottoms: Vec<[f64; 2]> = valleys.into_iter().map(|valley| bottom(valley, step, &off)).collect();
    bottoms.sort_by(|a, b| a[0].total_cmp(&b[0]));
    match bottoms.as_slice() {
        [best, others @ ..] if best[0] < FOLLOWS => {
            let is_rival = |other: &[f64; 2]| other[0] < RIVAL * best[0].max(RIGHT) && (other[1] - best[1]).abs() > APART;
            (!others.iter().any(is_rival)).then_some(best[1])
        }
        _ => None,
    }
}

fn grid(from: f64, to: f64, step: f64) -> Vec<f64> {
    (0..=((to - from) / step).max(0.0) as usize).map(|k| from + k as f64 * step).collect()
}

/// The lowest place of a valley, by steps that are halved.
fn bottom([mut best, mut at]: [f64; 2], mut step: f64, off: &dyn Fn(f64) -> f64) -> [f64; 2] {
    for _ in 0..HALVINGS {
        for next in [at - step, at + step] {
            let score = off(next);
            if score < best {
                (best, at) = (score, next);
            }
        }
        step /= 2.0;
    }
    [best, at]
}

/// Some readings all over a recording: when, and where.
fn moments(seen: &Series) -> Vec<(f64, Vec<f64>)> {
    let width = seen.ranges.len();
    let rows = seen.values.chunks_exact(width).map(|row| row[..3.min(width)].to_vec());
    let whole: Vec<(f64, Vec<f64>)> =
        seen.times.iter().copied().zip(rows).filter(|(_, row)| row.iter().all(|v| v.is_finite())).collect();
    let every = (whole.len() / MOMENTS).max(1);
    whole.into_iter().step_by(every).collect()
}

/// How far a track is off from a point of the tool at a shift, or from a place that the tool sees.
fn judged(robot: &Robot, joints: &Series, moments: &[(f64, Vec<f64>)], shift: f64) -> Option<f64> {
    let mut found = AtRests::default();
    for (at, row) in moments {
        if let Some(posture) = between(joints, at + shift) {
            found.postures.push(posture);
            found.rows.push(row.clone());
        }
    }
    if (found.rows.len() as f64) < COMMON * moments.len() as f64 {
        return None;
    }
    let by = [Seen::Tool, Seen::Room].into_iter().filter_map(|seen| misfit(robot, &found, seen));
    by.min_by(f64::total_cmp)
}

/// The joints at a moment, between two readings.
fn between(joints: &Series, at: f64) -> Option<Vec<f64>> {
    let width = joints.ranges.len();
    let k = joints.times.partition_point(|&t| t <= at);
    if k == 0 || k == joints.times.len() {
        return None;
    }
    let [from, to] = [joints.times[k - 1], joints.times[k]];
    let share = if to > from { (at - from) / (to - from) } else { 0.0 };
    let row = |k: usize| &joints.values[k * width..(k + 1) * width];
    Some(row(k - 1).iter().zip(row(k)).map(|(a, b)| a + share * (b - a)).collect())
}
