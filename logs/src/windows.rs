//! When the arm stood still: the longest intervals in which no joint moved more than its noise and resolution explain.

use std::collections::VecDeque;

use calibench::robot::{JointKind, Robot};
use calibench::units::{DEG, MM};

use crate::log::JointTrack;
use crate::series::period;

/// How far a joint at rest may creep from the middle of where it stands, beside its noise: rad, and m of a joint that slides.
const REST: [f64; 2] = [0.03 * DEG, 0.05 * MM];
/// Longest step of an encoder, rad and m.
const LONGEST_STEP: [f64; 2] = [0.5 * DEG, 1.0 * MM];
/// The same in steps of an encoder whose steps are seen.
const REST_IN_STEPS: f64 = 1.5;
/// The same in standard deviations of the noise of the readings.
const REST_IN_NOISE: f64 = 4.0;
/// The quantile of the second differences from which the noise is read: a fifth of a log is at rest, or nobody measured in it.
const QUIET: f64 = 0.2;
/// That quantile of the absolute value of a normal variate of unit variance.
const QUIET_OF_NORMAL: f64 = 0.253_347;
/// Variance of a second difference of independent readings, in theirs.
const SECOND_DIFFERENCE: f64 = 6.0;
/// A pause in the readings of so many of their usual periods, and at least so many seconds, ends an interval.
const PAUSE: (f64, f64) = (5.0, 0.2);
/// Time before the end of an interval that is not used, s: the next motion begins within the tolerance.
const BEFORE_END: f64 = 0.05;

/// An interval at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Still {
    /// First reading and the one after the last, by index, after the arm has settled.
    pub from: usize,
    pub to: usize,
    /// Times of the first and the last, s.
    pub begin: f64,
    pub end: f64,
}

/// What the intervals are to be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rest {
    /// Shortest interval after settling, s.
    pub shortest: f64,
    /// Time after a motion that is not used, s.
    pub settling: f64,
}

/// Intervals at rest, and how the others were refused.
#[derive(Debug, Clone, Default)]
pub(crate) struct Intervals {
    pub still: Vec<Still>,
    /// Begin and end of intervals that are too short after settling, s.
    pub short: Vec<[f64; 2]>,
    /// Those in which a joint creeps.
    pub creeping: Vec<[f64; 2]>,
    /// Half of the range in which each joint is at rest, rad or m.
    pub tolerance: Vec<f64>,
}

/// The intervals in which no joint moves. Times must not decrease.
pub(crate) fn intervals(times: &[f64], track: &JointTrack, robot: &Robot, rest: Rest) -> Intervals {
    let joints = track.joints.len();
    let noise: Vec<f64> = (0..joints).map(|j| noise_of(&track.positions, joints, j)).collect();
    let slack = |j: usize| REST[usize::from(robot.kind(j) == JointKind::Prismatic)];
    let longest = |j: usize| LONGEST_STEP[usize::from(robot.kind(j) == JointKind::Prismatic)];
    let step: Vec<f64> = (0..joints).map(|j| step_of(&track.positions, joints, j, longest(j))).collect();
    let tolerance: Vec<f64> = (0..joints).map(|j| slack(j) + REST_IN_STEPS * step[j] + REST_IN_NOISE * noise[j]).collect();
    let mut found = Intervals { tolerance: tolerance.clone(), ..Intervals::default() };
    for (from, to) in quiet_runs(times, &track.positions, &tolerance) {
        let [begin, end] = [times[from] + rest.settling, times[to - 1] - BEFORE_END];
        let inside = |t: f64| times[from..to].partition_point(|&at| at < t) + from;
        let (first, last) = (inside(begin), inside(end));
        if end - begin < rest.shortest || last <= first {
            // A moment between two motions is not worth a word.
            if times[to - 1] - times[from] >= rest.shortest {
                found.short.push([times[from], times[to - 1]]);
            }
            continue;
        }
        let creeps = |j: usize| {
            let third = (last - first).div_ceil(3);
            let mean = |a: usize, b: usize| (a..b).map(|k| track.positions[k * joints + j]).sum::<f64>() / (b - a) as f64;
            let moved = (mean(last - third, last) - mean(first, first + third)).abs();
            moved > slack(j) + step[j] + REST_IN_NOISE * noise[j] * (2.0 / third as f64).sqrt()
        };
        if (0..joints).any(creeps) {
            found.creeping.push([times[first], times[last - 1]]);
            continue;
        }
        found.still.push(Still { from: first, to: last, begin: times[first], end: times[last - 1] });
    }
    found
}

/// Standard deviation of the readings of a joint about its motion.
fn noise_of(positions: &[f64], joints: usize, j: usize) -> f64 {
    let of: Vec<f64> = positions.iter().skip(j).step_by(joints).copied().collect();
    let mut second: Vec<f64> = of.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
    if second.is_empty() {
        return 0.0;
    }
    second.sort_unstable_by(f64::total_cmp);
    let quiet = second[(QUIET * (second.len() - 1) as f64) as usize];
    quiet / QUIET_OF_NORMAL / SECOND_DIFFERENCE.sqrt()
}

/// The step in which the positions of a joint are stated, if all of them are multiples of it apart; zero if none is seen, or if it is
/// so long that it is a motion.
fn step_of(positions: &[f64], joints: usize, j: usize, longest: f64) -> f64 {
    /// How far a multiple of the step may be off, in steps: numbers are rounded.
    const OFF: f64 = 0.05;
    /// Most positions between two that are compared: with longer ones the rounding of the step adds up.
    const STEPS: f64 = 20.0;
    let of: Vec<f64> = positions.iter().skip(j).step_by(joints).copied().collect();
    let differences = || of.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0);
    let smallest = differences().fold(f64::INFINITY, f64::min);
    if smallest > longest {
        return 0.0;
    }
    let is_multiple = |d: f64| (d / smallest - (d / smallest).round()).abs() <= OFF;
    let (mut short, mut multiples) = (0usize, 0usize);
    for d in differences().filter(|d| *d < STEPS * smallest) {
        short += 1;
        multiples += usize::from(is_multiple(d));
    }
    if short > 2 && multiples == short { smallest } else { 0.0 }
}

/// The longest runs of readings in which every joint stays within twice its tolerance.
fn quiet_runs(times: &[f64], positions: &[f64], tolerance: &[f64]) -> Vec<(usize, usize)> {
    let joints = tolerance.len();
    let usual = period(times).unwrap_or(0.0);
    let pause = (PAUSE.0 * usual).max(PAUSE.1);
    let mut runs = Vec::new();
    // Indices of falling and of rising positions: the first of each is the largest and the smallest of the run.
    let mut falling = vec![VecDeque::<usize>::new(); joints];
    let mut rising = vec![VecDeque::<usize>::new(); joints];
    let mut start = 0;
    for k in 0..times.len() {
        let is_pause = k > 0 && times[k] - times[k - 1] > pause;
        for j in 0..joints {
            let at = |i: usize| positions[i * joints + j];
            while falling[j].back().is_some_and(|&i| at(i) <= at(k)) {
                falling[j].pop_back();
            }
            falling[j].push_back(k);
            while rising[j].back().is_some_and(|&i| at(i) >= at(k)) {
                rising[j].pop_back();
            }
            rising[j].push_back(k);
        }
        let moved = |falling: &[VecDeque<usize>], rising: &[VecDeque<usize>]| {
            (0..joints).any(|j| match (falling[j].front(), rising[j].front()) {
                (Some(&high), Some(&low)) => positions[high * joints + j] - positions[low * joints + j] > 2.0 * tolerance[j],
                _ => false,
            })
        };
        if !is_pause && !moved(&falling, &rising) {
            continue;
        }
        runs.push((start, k));
        // A run that was long is followed by the next; a short one may have begun before the arm stood.
        let next = if is_pause { k } else { start + 1 };
        start = next;
        loop {
            for ends in falling.iter_mut().chain(rising.iter_mut()) {
                while ends.front().is_some_and(|&i| i < start) {
                    ends.pop_front();
                }
            }
            if start >= k || !moved(&falling, &rising) {
                break;
            }
            start += 1;
        }
    }
    runs.push((start, times.len()));
    apart(runs)
}

/// Of runs that overlap the longest.
fn apart(mut runs: Vec<(usize, usize)>) -> Vec<(usize, usize)> {
    runs.retain(|(from, to)| to > from);
    runs.sort_by_key(|(from, to)| (std::cmp::Reverse(to - from), *from));
    let mut chosen: std::collections::BTreeMap<usize, usize> = std::collections::BTreeMap::new();
    for (from, to) in runs {
        let before = chosen.range(..to).next_back().map(|(_, end)| *end);
        if before.is_none_or(|end| end <= from) {
            chosen.insert(from, to);
        }
    }
    chosen.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use calibench::robot::built_in;

    use super::*;
    use crate::log::Times;

    /// A joint that rests for 2 s and moves for 1 s, ten times, at 100 Hz.
    fn track(rate: f64, creep: f64) -> (Vec<f64>, JointTrack) {
        let mut track = JointTrack { joints: vec!["j".into()], is_si: true, times: Times::default(), ..JointTrack::default() };
        let count = (30.0 * rate) as usize;
        for k in 0..count {
            let t = k as f64 / rate;
            let (cycle, phase) = ((t / 3.0).floor(), t % 3.0);
            let q = cycle * 0.2 + 0.2 * (phase - 2.0).clamp(0.0, 1.0) + creep * t;
            track.push(t, t, &[q]);
        }
        (track.times.stated.clone(), track)
    }

    #[test]
    fn every_rest_is_found_and_a_slow_motion_is_none() {
        let robot = built_in("ur5").expect("built in");
        let rest = Rest { shortest: 0.5, settling: 0.3 };
        for rate in [10.0, 100.0, 1000.0] {
            let (times, still) = track(rate, 0.0);
            let found = intervals(&times, &still, &robot, rest);
            assert_eq!(found.still.len(), 10, "{rate}");
            for (k, still) in found.still.iter().enumerate() {
                let begun = 3.0 * k as f64;
                assert!(still.begin >= begun + 0.2 && still.end <= begun + 2.0 + 1.5 / rate, "{rate} {still:?}");
            }
            // Half a degree a second is no rest.
            let (times, slow) = track(rate, 0.5 * DEG);
            assert!(intervals(&times, &slow, &robot, rest).still.is_empty());
        }
    }
}
