//! Rows of which one is a copy of another: they say the same, and not the same again.

use std::collections::{HashMap, HashSet};

use crate::measure::{Dataset, Measured, Sample};

/// Share of the rows that may agree by chance: an instrument of coarse steps reads the same again now and then.
const BY_CHANCE: f64 = 0.2;

/// The numbers of a row, and its target.
fn key(sample: &Sample) -> Vec<u64> {
    let target = sample.tool_target.map_or(0, |target| 1 + target as u64);
    sample.numbers().map(f64::to_bits).chain([target]).collect()
}

/// False of a ball that was centred to zero: equal joints are all that two of its rows can have in common.
fn is_read(sample: &Sample) -> bool {
    !matches!(sample.measured, Measured::Ball { reading: None, .. })
}

/// Two rows of one dataset that are the same measurement: equal in all numbers and in their time, or without times, where more
/// of them are equal than chance has it.
pub(super) fn same_measurement(samples: &[Sample]) -> Option<(&Sample, &Sample)> {
    let mut of_key: HashMap<Vec<u64>, Vec<&Sample>> = HashMap::new();
    let mut by_chance = Vec::new();
    for sample in samples {
        let alike = of_key.entry(key(sample)).or_default();
        if let Some(first) = alike.iter().find(|first| sample.time_s.is_some() && first.time_s == sample.time_s) {
            return Some((*first, sample));
        }
        if let Some(first) = alike.iter().find(|first| first.time_s.is_none() || sample.time_s.is_none())
            && is_read(sample)
        {
            by_chance.push((*first, sample));
        }
        alike.push(sample);
    }
    let too_many = by_chance.len() as f64 > BY_CHANCE * samples.len() as f64;
    by_chance.first().copied().filter(|_| too_many)
}

/// Number of rows of a check that are rows of an earlier one as well; `None` if they are no more than chance has it.
pub fn rows_again(now: &Dataset, earlier: &Dataset) -> Option<usize> {
    let keys = |dataset: &Dataset| dataset.samples.iter().filter(|s| is_read(s)).map(key).collect::<HashSet<_>>();
    let same = keys(now).intersection(&keys(earlier)).count();
    let fewer = now.samples.len().min(earlier.samples.len());
    (same as f64 > BY_CHANCE * fewer as f64).then_some(same)
}
