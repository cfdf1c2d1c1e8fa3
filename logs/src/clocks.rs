//! By how much the clock of an instrument differs from that of the joints: both see when the arm moves.

use crate::log::Times;
use crate::series::{Series, period};

/// Largest difference of two clocks that are said to be one: delays of a camera or of a network, s.
pub(crate) const DELAY: f64 = 1.0;
/// Step in which delays are found, s.
const FINE: f64 = 0.01;
/// Step in which clocks that know nothing of each other are matched, s.
const COARSE: f64 = 0.1;
/// Most steps of an activity: a longer log is matched in longer steps.
const MOST_STEPS: usize = 40_000;
/// Smallest share of the shorter log that both must have in common.
const COMMON: f64 = 0.5;
/// Times at least as large as those of 1990 count from 1970, s.
const SINCE_1970: f64 = 6.3e8;
/// Speeds above that quantile of all which half of the time of the arm's motion leaves are one speed: wrong readings jump farther
/// than any arm moves.
const FASTEST: f64 = 0.5;
/// The arm moves if its speed is more than this share of its fastest.
const MOVES: f64 = 0.05;
/// Smallest correlation at which two clocks are matched.
const ALIKE: f64 = 0.4;
/// Another shift with more than this share of the best correlation leaves it open which is right.
pub(crate) const RIVAL: f64 = 0.8;
/// Shifts farther apart than this are different ones, s.
const APART: f64 = 0.5;
/// Most shifts that are tried.
const MOST_SHIFTS: usize = 24;
/// Time over which a motion is seen, s: single wrong readings and the steps of an encoder are short.
const MOTION: f64 = 0.2;
/// Longest pause of an instrument over which its reading holds, s.
const HELD: f64 = 3.0;
/// Largest period of readings that show when the arm moves, s.
const DENSE: f64 = 0.3;

/// A shift to be added to the times of an instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shift {
    pub seconds: f64,
    /// Correlation of the motions.
    pub alike: f64,
}

/// Whose times two tracks have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Clock {
    /// Those stated with the data.
    Stated,
    /// Those of the recorder.
    Recorded,
    /// None: the clocks know nothing of each other.
    None,
}

impl Clock {
    /// The clock by which two tracks were taken at the same time. Those of two recorders are one if both count from 1970; others
    /// may both begin at zero, and have nothing in common.
    pub fn of(joints: &Times, track: &Times, is_one_recording: bool) -> Self {
        let is_calendar = |times: &Times| times.stated.first().is_some_and(|t| *t >= SINCE_1970);
        let is_one_clock = is_one_recording || (is_calendar(joints) && is_calendar(track));
        if !is_one_clock {
            return Clock::None;
        }
        let is_shared = |a: &[f64], b: &[f64]| {
            let (Some(([a0, a1], long)), Some(([b0, b1], short))) = (ends(a), ends(b)) else { return false };
            a1.min(b1) - a0.max(b0) >= COMMON * long.min(short)
        };
        if is_shared(&joints.stated, &track.stated) {
            Clock::Stated
        } else if is_shared(&joints.recorded, &track.recorded) {
            Clock::Recorded
        } else {
            Clock::None
        }
    }

    /// The times of a track by this clock.
    pub fn times(self, of: &Times) -> &[f64] {
        if self == Clock::Recorded { &of.recorded } else { &of.stated }
    }
}

fn ends(times: &[f64]) -> Option<([f64; 2], f64)> {
    let (first, last) = times.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &t| (a.min(t), b.max(t)));
    (first <= last).then_some(([first, last], last - first))
}

/// The delay of an instrument on the same clock: zero if its readings are too few to show when the arm moves, `None` if they show that
/// it does not move with the arm.
pub(crate) fn delay(joints: &Series, track: &Series) -> Option<f64> {
    if !shows_motion(joints, track) {
        return Some(0.0);
    }
    // The longest delay is one that is longer.
    let is_within = |shift: &Shift| shift.alike >= ALIKE && shift.seconds.abs() < DELAY - FINE / 2.0;
    refined(joints, track, 0.0, DELAY).filter(is_within).map(|shift| shift.seconds)
}

/// The shifts at which both move at the same times, where the clocks know nothing of each other, the likeliest first.
pub(crate) fn shifts(joints: &Series, track: &Series) -> Vec<Shift> {
    if !shows_motion(joints, track) {
        return Vec::new();
    }
    let (Some(([from, to], length)), Some(([seen_from, seen_to], long))) = (ends(&joints.times), ends(&track.times)) else {
        return Vec::new();
    };
    let step = COARSE.max((length.max(long)) / MOST_STEPS as f64);
    let of_joints = activity(joints, from, to, step);
    let lags = matched(&of_joints, &seen(track, seen_from, seen_to, step, moving(&of_joints)), step);
    let near = lags.into_iter().filter_map(|lag| refined(joints, track, from - seen_from + lag as f64 * step, 2.0 * step));
    let mut found: Vec<Shift> = near.filter(|shift| shift.alike >= ALIKE).collect();
    found.sort_by(|a, b| b.alike.total_cmp(&a.alike));
    found
}

/// The best shift within so many seconds of one.
fn refined(joints: &Series, track: &Series, about: f64, around: f64) -> Option<Shift> {
    let ([from, to], _) = ends(&joints.times)?;
    let ([seen_from, seen_to], _) = ends(&track.times)?;
    let begin = from.max(seen_from + about);
    let end = to.min(seen_to + about).min(begin + FINE * MOST_STEPS as f64);
    let of_joints = activity(joints, begin, end, FINE);
    let steps = (around / FINE).ceil() as isize;
    let around = steps as f64 * FINE;
    let of_track = seen(track, begin - about - around, end - about + around, FINE, moving(&of_joints));
    let score = |lag: isize| {
        let offset = (steps - lag) as usize;
        of_track.get(offset..offset + of_joints.len()).map_or(0.0, |seen| correlation(&of_joints, seen))
    };
    let (alike, lag) = (-steps..=steps).map(|lag| (score(lag), lag)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Shift { seconds: about + lag as f64 * FINE, alike })
}

/// True if both were read often enough to show when the arm moves.
pub(crate) fn shows_motion(joints: &Series, track: &Series) -> bool {
    is_dense(&track.times) && is_dense(&joints.times)
}

fn is_dense(times: &[f64]) -> bool {
    period(times).is_some_and(|period| period <= DENSE)
}

/// The root of how fast the numbers change at each step, in their ranges: between how far and whether, so that a fast motion does
/// not drown the others, and rests of one length differ by it.
fn activity(of: &Series, from: f64, to: f64, step: f64) -> Vec<f64> {
    let count = ((to - from) / step).ceil().max(0.0) as usize;
    let half = (MOTION / 2.0 / step).round().max(1.0) as usize;
    let mut speed = vec![0.0; count];
    for (c, &range) in of.ranges.iter().enumerate().filter(|(_, range)| **range > 0.0) {
        let column: Vec<f64> = of.values.iter().skip(c).step_by(of.ranges.len()).copied().collect();
        let begin = from - half as f64 * step;
        let at = resampled(&of.times, &column, begin, step, count + 2 * half);
        for (k, speed) in speed.iter_mut().enumerate() {
            let moved = (at[k + 2 * half] - at[k]).abs() / range;
            *speed += if moved.is_finite() { moved } else { 0.0 };
        }
    }
    speed.iter().map(|v| v.sqrt()).collect()
}

/// The same of an instrument, which sees the arm move for as long as it moves.
fn seen(of: &Series, from: f64, to: f64, step: f64, moving: f64) -> Vec<f64> {
    let speed = activity(of, from, to, step);
    let mut sorted = speed.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let fastest = sorted.get(((1.0 - FASTEST * moving) * sorted.len() as f64) as usize).copied().unwrap_or(f64::INFINITY);
    speed.iter().map(|v| v.min(fastest)).collect()
}

/// The share of the time in which an arm of this activity moves.
fn moving(activity: &[f64]) -> f64 {
    let fastest = activity.iter().copied().fold(0.0, f64::max);
    let moves = activity.iter().filter(|v| v.powi(2) > MOVES * fastest.powi(2)).count();
    moves as f64 / activity.len().max(1) as f64
}

/// A column at equal steps, each reading the middle one of five; not a number where nothing was read for long.
fn resampled(times: &[f64], column: &[f64], from: f64, step: f64, count: usize) -> Vec<f64> {
    let kept: Vec<usize> = (0..times.len()).filter(|&k| column[k].is_finite()).collect();
    let middle = |n: usize| {
        let mut five: Vec<f64> = (n.saturating_sub(2)..(n + 3).min(kept.len())).map(|n| column[kept[n]]).collect();
        five.sort_unstable_by(f64::total_cmp);
        five[five.len() / 2]
    };
    let mut n = 0;
    (0..count)
        .map(|k| {
            let t = from + k as f64 * step;
            while n + 1 < kept.len() && times[kept[n + 1]] <= t {
                n += 1;
            }
            let Some(&first) = kept.get(n) else { return f64::NAN };
            let Some(&next) = kept.get(n + 1).filter(|_| times[first] <= t) else { return f64::NAN };
            let passed = times[next] - times[first];
            if passed > HELD {
                return f64::NAN;
            }
            let share = if passed > 0.0 { (t - times[first]) / passed } else { 0.0 };
            middle(n) + share * (middle(n + 1) - middle(n))
        })
        .collect()
}

/// The lags of `seen` against `joints`, in steps, at which both are alike, the likeliest first.
fn matched(joints: &[f64], seen: &[f64], step: f64) -> Vec<isize> {
    let least = (COMMON * joints.len().min(seen.len()) as f64).max(10.0) as isize;
    let lags = least - seen.len() as isize..=joints.len() as isize - least;
    let score = |lag: isize| {
        let from = lag.max(0) as usize;
        let to = joints.len().min((seen.len() as isize + lag).max(0) as usize);
        let begin = (from as isize - lag) as usize;
        joints.get(from..to).map_or(0.0, |part| correlation(part, &seen[begin..begin + part.len()]))
    };
    let mut scores: Vec<(f64, isize)> = lags.map(|lag| (score(lag), lag)).collect();
    scores.sort_by(|a, b| b.0.total_cmp(&a.0));
    let apart = (APART / step).ceil() as isize;
    let mut found: Vec<isize> = Vec::new();
    for (_, lag) in scores.into_iter().take_while(|(alike, _)| *alike >= ALIKE / 2.0) {
        if found.iter().all(|other| (other - lag).abs() > apart) {
            found.push(lag);
        }
        if found.len() == MOST_SHIFTS {
            break;
        }
    }
    found
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (mut sa, mut sb, mut saa, mut sbb, mut sab) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        sa += x;
        sb += y;
        saa += x * x;
        sbb += y * y;
        sab += x * y;
    }
    let [va, vb] = [saa - sa * sa / n, sbb - sb * sb / n];
    if va > 0.0 && vb > 0.0 { (sab - sa * sb / n) / (va * vb).sqrt() } else { 0.0 }
}
