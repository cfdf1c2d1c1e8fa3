//! Copies: rows of equal values that are not new measurements; and digests by which a campaign is recognised.

use std::collections::{HashMap, HashSet};

use nalgebra::DVector;
use sha2::{Digest, Sha256};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::CheckReference;
use crate::files::hexadecimal;
use crate::measure::dataset::{Dataset, Measured, Sample};

/// Share of the rows of the smaller of two measurements that may agree by chance: an instrument of coarse steps reads the same
/// again now and then.
const BY_CHANCE: f64 = 0.2;

/// Number of rows that are in both, by their numbers; `None` if they are no more than chance has it. The measurements have so
/// many rows.
pub(crate) fn in_both(rows: [&HashSet<Vec<u64>>; 2], counts: [usize; 2]) -> Option<usize> {
    let same = rows[0].intersection(rows[1]).count();
    (same as f64 > BY_CHANCE * counts[0].min(counts[1]) as f64).then_some(same)
}

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
///
/// ```
/// use calibench::measure::dataset::{Dataset, Measured, Sample};
/// use calibench::monitoring::check::rows_again;
/// use calibench::nalgebra::Vector3;
///
/// let point = |k: usize| Measured::Point(Vector3::new(0.5, 0.0, 0.01 * k as f64));
/// let row = |k: usize| Sample::new(format!("p{k}"), vec![0.1 * k as f64; 6], point(k));
/// let rows = |places: std::ops::Range<usize>| Dataset { samples: places.map(row).collect(), ..Dataset::default() };
/// assert_eq!(rows_again(&rows(0..10), &rows(0..40)), Some(10));
/// assert_eq!(rows_again(&rows(40..50), &rows(0..40)), None);
/// ```
pub fn rows_again(now: &Dataset, earlier: &Dataset) -> Option<usize> {
    let keys = |dataset: &Dataset| dataset.samples.iter().filter(|s| is_read(s)).map(key).collect::<HashSet<_>>();
    in_both([&keys(now), &keys(earlier)], [now.samples.len(), earlier.samples.len()])
}

/// Probability, by chance, of changes as small as those of a check that is reported as a copy: rows of the campaign itself with
/// fewer digits change far less.
const HARDLY_EVER: f64 = 1e-9;

/// Root mean square of the changes, whitened by their noise, if chance hardly ever leaves as little.
pub(super) fn too_alike(changes: &DVector<f64>) -> Option<f64> {
    let squares = changes.norm_squared();
    let chance = ChiSquared::new(changes.len() as f64).map_or(1.0, |law| law.cdf(squares));
    (chance < HARDLY_EVER).then(|| (squares / changes.len() as f64).sqrt())
}

impl CheckReference<'_> {
    /// Digests of the calibration and of the campaign: of their numbers, in whatever way these are written.
    pub fn digests(&self) -> [String; 2] {
        let number = |x: f64| format!("{x:e}");
        let mut estimates = vec![self.calibration.robot.name.clone()];
        estimates.extend(self.calibration.estimates.iter().map(|e| format!("{}={:e}", e.name, e.value)));
        let then = self.then.dataset;
        let mut numbers: Vec<String> = then.base.to_array().into_iter().chain(then.tool.to_array()).map(number).collect();
        numbers.extend(then.balls.iter().flat_map(|ball| ball.position.iter().copied().map(number)));
        numbers.extend(then.samples.iter().flat_map(|sample| sample.numbers().map(number)));
        [estimates, numbers].map(|words| hexadecimal(&Sha256::digest(words.join(" "))[..8]))
    }
}
