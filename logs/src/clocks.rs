//! By how much the clock of an instrument differs from that of the joints: both see when the arm moves.

use crate::log::Times;

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
/// Smallest correlation at which two clocks are matched.
const ALIKE: f64 = 0.5;
/// Another shift with more than this share of the best correlation leaves it open which is right.
const RIVAL: f64 = 0.9;
/// Shifts farther apart than this are different ones, s.
const APART: f64 = 3.0;
/// Largest period of readings that show when the arm moves, s.
const DENSE: f64 = 0.3;

/// A shift to be added to the times of an instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shift {
    pub seconds: f64,
    /// True if the clocks know nothing of each other.
    pub is_matched: bool,
}

/// Rows of numbers over time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moving<'a> {
    pub times: &'a [f64],
    pub values: &'a [f64],
    /// Numbers a row.
    pub width: usize,
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
    /// The clock by which two tracks were taken at the same time.
    pub fn of(joints: &Times, track: &Times) -> Self {
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

/// Finds the shift, `None` if no one stands out, or if readings are too few to show when the arm moves.
pub(crate) fn shift(joints: Moving<'_>, track: Moving<'_>, is_common: bool) -> Option<Shift> {
    if !is_dense(track.times) || !is_dense(joints.times) {
        return is_common.then_some(Shift { seconds: 0.0, is_matched: false });
    }
    let ([from, to], length) = ends(joints.times)?;
    let ([seen_from, seen_to], seen) = ends(track.times)?;
    let (coarse, is_matched) = if is_common {
        (0.0, false)
    } else {
        let step = COARSE.max((length.max(seen)) / MOST_STEPS as f64);
        let all = matched(&activity(joints, from, to, step), &activity(track, seen_from, seen_to, step))?;
        (from - seen_from + all as f64 * step, true)
    };
    let around = if is_common { DELAY } else { 3.0 * COARSE };
    let [begin, end] = [from.max(seen_from + coarse), to.min(seen_to + coarse)];
    let most = FINE * MOST_STEPS as f64;
    let end = end.min(begin + most);
    let of_joints = activity(joints, begin, end, FINE);
    let steps = (around / FINE) as isize;
    let of_track = activity(track, begin - coarse - around, end - coarse + around, FINE);
    let score = |lag: isize| {
        let offset = (steps - lag) as usize;
        of_track.get(offset..offset + of_joints.len()).map_or(0.0, |seen| correlation(&of_joints, seen))
    };
    let (best, lag) = (-steps..=steps).map(|lag| (score(lag), lag)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    match (best >= ALIKE, is_common) {
        (true, _) => Some(Shift { seconds: coarse + lag as f64 * FINE, is_matched }),
        // One clock for both needs no proof.
        (false, true) => Some(Shift { seconds: 0.0, is_matched: false }),
        (false, false) => None,
    }
}

fn is_dense(times: &[f64]) -> bool {
    let mut periods: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    periods.sort_unstable_by(f64::total_cmp);
    periods.get(periods.len() / 2).is_some_and(|period| *period <= DENSE)
}

/// The root of how fast the numbers change in each step; that of the step before where nothing was read.
fn activity(of: Moving<'_>, from: f64, to: f64, step: f64) -> Vec<f64> {
    let count = ((to - from) / step).ceil().max(0.0) as usize;
    let spread: Vec<f64> = (0..of.width).map(|c| spread(of.values.iter().skip(c).step_by(of.width))).collect();
    let mut speed = vec![f64::NAN; count];
    let rows = of.values.chunks_exact(of.width.max(1));
    for (pair, times) in rows.clone().zip(rows.skip(1)).zip(of.times.windows(2)) {
        let passed = times[1] - times[0];
        if passed <= 0.0 {
            continue;
        }
        let changed = |c: usize| match spread[c] {
            s if s > 0.0 && pair.0[c].is_finite() && pair.1[c].is_finite() => (pair.1[c] - pair.0[c]).abs() / s,
            _ => 0.0,
        };
        let moved = (0..of.width).map(changed).sum::<f64>() / passed;
        let place = |t: f64| ((t - from) / step).floor();
        let [first, last] = [place(times[0]).max(0.0), place(times[1])];
        // Over a long pause nothing is known.
        if last < 0.0 || passed > DENSE * 10.0 {
            continue;
        }
        for slot in speed.iter_mut().take(last as usize + 1).skip(first as usize) {
            *slot = if slot.is_nan() { moved } else { slot.max(moved) };
        }
    }
    let mut before = 0.0;
    for slot in &mut speed {
        if slot.is_nan() {
            *slot = before;
        }
        before = *slot;
        // Between how far and whether: a fast motion shall not drown the others, and rests of one length are told apart by it.
        *slot = slot.sqrt();
    }
    speed
}

fn spread<'a>(values: impl Iterator<Item = &'a f64>) -> f64 {
    let (low, high) =
        values.filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
    if high > low { high - low } else { 0.0 }
}

/// The lag of `seen` against `joints`, in steps, if one stands out.
fn matched(joints: &[f64], seen: &[f64]) -> Option<isize> {
    let least = (COMMON * joints.len().min(seen.len()) as f64).max(10.0) as isize;
    let lags = least - seen.len() as isize..=joints.len() as isize - least;
    let score = |lag: isize| {
        let from = lag.max(0) as usize;
        let to = joints.len().min((seen.len() as isize + lag).max(0) as usize);
        let begin = (from as isize - lag) as usize;
        joints.get(from..to).map_or(0.0, |part| correlation(part, &seen[begin..begin + part.len()]))
    };
    let scores: Vec<(f64, isize)> = lags.map(|lag| (score(lag), lag)).collect();
    let best = scores.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let apart = (APART / COARSE) as isize;
    let rival = scores.iter().filter(|(_, lag)| (lag - best.1).abs() > apart).map(|(s, _)| *s).fold(0.0, f64::max);
    (best.0 >= ALIKE && rival < RIVAL * best.0).then_some(best.1)
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
