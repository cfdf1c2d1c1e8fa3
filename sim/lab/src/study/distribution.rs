//! Distribution of a number over any number of trials, in little memory.

use std::collections::BTreeMap;

/// Twelve bits of a number's fraction are kept, so a quantile is accurate to 1.2e-4 of itself. A million trials determine a
/// median no better than that if they scatter by a tenth.
const DROPPED: u32 = 52 - 12;

/// Counts of numbers by their leading bits: memory grows with the range of the numbers, not with their count, and the order of
/// arrival is irrelevant.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Distribution {
    counts: BTreeMap<u64, u64>,
    count: u64,
    sum: f64,
}

impl Distribution {
    /// Counts one more number; NaN is skipped.
    pub fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        *self.counts.entry(bin(value)).or_default() += 1;
        self.count += 1;
        self.sum += value;
    }

    /// Count of the numbers.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean; NaN if there are none.
    pub fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }

    /// The number of that rank, from 1, ascending: the middle of its bin of equal leading bits.
    pub fn ranked(&self, rank: u64) -> Option<f64> {
        let mut below = 0;
        for (&bits, &count) in &self.counts {
            below += count;
            if rank >= 1 && below >= rank {
                return Some(middle(bits));
            }
        }
        None
    }

    /// The quantile for that share.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        self.ranked(((share * self.count as f64).ceil() as u64).clamp(1, self.count.max(1)))
    }
}

/// The bin of a number: bins are ordered as numbers are.
pub(super) fn bin(value: f64) -> u64 {
    ordered(value) >> DROPPED
}

/// The middle of a bin.
pub(super) fn middle(bin: u64) -> f64 {
    value_of((bin << DROPPED) | (1 << (DROPPED - 1)))
}

/// Maps a number to bits of the same order.
fn ordered(value: f64) -> u64 {
    let bits = value.to_bits();
    if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
}

fn value_of(ordered: u64) -> f64 {
    f64::from_bits(if ordered >> 63 == 1 { ordered & !(1 << 63) } else { !ordered })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    #[test]
    fn quantiles_are_those_of_the_sorted_numbers_to_a_few_parts_in_ten_thousand() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for spread in [0.1, 3.0] {
            let mut values: Vec<f64> =
                (0..5000).map(|_| 0.3 * (spread * random.sample::<f64, _>(StandardNormal)).exp()).collect();
            values.extend([-1.0, -1e-3, 1e6]);
            let mut distribution = Distribution::default();
            values.iter().for_each(|v| distribution.add(*v));
            distribution.add(f64::NAN);
            values.sort_by(f64::total_cmp);
            assert_eq!(distribution.count(), values.len() as u64);
            for share in [0.0, 1e-4, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0] {
                let exact = values[((share * values.len() as f64).ceil() as usize).clamp(1, values.len()) - 1];
                let found = distribution.quantile(share).expect("numbers");
                assert!((found / exact - 1.0).abs() < 1.3e-4, "{share}: {found}, {exact}");
            }
        }
    }

    #[test]
    fn a_million_numbers_that_scatter_by_a_tenth_need_few_counts() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut distribution = Distribution::default();
        (0..1_000_000).for_each(|_| distribution.add(0.3 * (0.1 * random.sample::<f64, _>(StandardNormal)).exp()));
        assert!(distribution.counts.len() < 8_000, "{}", distribution.counts.len());
    }

    #[test]
    fn of_nothing_there_is_nothing() {
        let nothing = Distribution::default();
        assert_eq!((nothing.quantile(0.5), nothing.ranked(1), nothing.count()), (None, None, 0));
        assert!(nothing.mean().is_nan());
    }
}
