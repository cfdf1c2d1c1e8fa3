//! Whether an arm stands still.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Joint readings of the last moments.
#[derive(Debug, Clone)]
pub struct Stillness {
    wait: Duration,
    /// Largest range of each joint, in the unit of its readings.
    within: Vec<f64>,
    seen: VecDeque<(Instant, Vec<f64>)>,
}

/// What the arm does.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// A joint, counted from 1, has moved; by this much within the time.
    Moving {
        /// Joint, counted from 1.
        joint: usize,
        /// Range of its readings.
        by: f64,
    },
    /// No joint has moved, for less than the time yet.
    Settling,
    /// No joint has moved for the time: the mean of its readings.
    Still(Vec<f64>),
}

impl Stillness {
    /// An arm counts as still when no joint moved by more than `within` for `wait`.
    pub fn new(wait: Duration, within: Vec<f64>) -> Self {
        Stillness { wait, within, seen: VecDeque::new() }
    }

    /// Takes a reading, and says what the arm does.
    pub fn add(&mut self, at: Instant, joints: &[f64]) -> Motion {
        self.seen.push_back((at, joints.to_vec()));
        // The reading at the beginning of the time, or the last before it, stays.
        while self.seen.get(1).is_some_and(|(second, _)| at.duration_since(*second) >= self.wait) {
            self.seen.pop_front();
        }
        let range = |k: usize| {
            let values = || self.seen.iter().filter_map(|(_, q)| q.get(k).copied());
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let moved = (0..joints.len()).map(|k| (k, range(k))).find(|&(k, range)| self.within.get(k).is_some_and(|w| range > *w));
        if let Some((k, by)) = moved {
            return Motion::Moving { joint: k + 1, by };
        }
        let has_waited = self.seen.front().is_some_and(|(first, _)| at.duration_since(*first) >= self.wait);
        if !has_waited {
            return Motion::Settling;
        }
        let mean = |k: usize| self.seen.iter().filter_map(|(_, q)| q.get(k)).sum::<f64>() / self.seen.len() as f64;
        Motion::Still((0..joints.len()).map(mean).collect())
    }

    /// Forgets all readings: what was read before a gap says nothing.
    pub fn forget(&mut self) {
        self.seen.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_is_still_once_no_joint_has_moved_for_the_time() {
        let began = Instant::now();
        let at = |ms: u64| began + Duration::from_millis(ms);
        let mut stillness = Stillness::new(Duration::from_millis(500), vec![0.02, 0.02]);
        assert_eq!(stillness.add(at(0), &[1.0, 5.0]), Motion::Settling);
        assert_eq!(stillness.add(at(200), &[1.0, 5.5]), Motion::Moving { joint: 2, by: 0.5 });
        assert_eq!(stillness.add(at(400), &[1.0, 6.0]), Motion::Moving { joint: 2, by: 1.0 });
        // The last motion ended at 400 ms; a step of the read-out's resolution is none.
        assert_eq!(stillness.add(at(800), &[1.0, 6.25]), Motion::Moving { joint: 2, by: 0.75 });
        assert!(matches!(stillness.add(at(1400), &[1.0, 6.26]), Motion::Still(_)));
        stillness.forget();
        assert_eq!(stillness.add(at(1100), &[1.0, 6.0]), Motion::Settling);
    }
}
