//! Uncertainty of a study's results: bands that cover the result of infinitely many trials in 95 of 100 studies.

use serde::Serialize;
use statrs::distribution::{Binomial, DiscreteCDF};

/// Probability that a band misses on either side.
const MISS: f64 = 0.025;

/// Half-width of a 95 % interval of a normal variable, in standard deviations.
pub const HALF_WIDTH: f64 = 1.959_963_984_540_054;

/// Ranks (from 1, ascending) of the values that bracket the quantile `share` of a distribution, given `n` values sampled from
/// it; `None` for a side that so few values do not bound.
///
/// The number of values below the quantile is binomial, whatever the distribution (David, Nagaraja, Order Statistics, section
/// 7.1): the band misses it in at most 2.5 % of studies on either side.
pub fn quantile_band(n: u64, share: f64) -> [Option<u64>; 2] {
    let Ok(below) = Binomial::new(share, n) else { return [None, None] };
    if n == 0 {
        return [None, None];
    }
    // The least k with P(at most k below) >= 2.5 %: P(at most k - 1) is less.
    let low = below.inverse_cdf(MISS);
    let high = below.inverse_cdf(1.0 - MISS) + 1;
    [(low >= 1).then_some(low), (high <= n).then_some(high)]
}

/// A share of trials.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Share {
    /// Number of trials with the property.
    pub count: u64,
    /// Number of all trials.
    pub of: u64,
}

impl Share {
    /// The share; NaN without trials.
    pub fn value(&self) -> f64 {
        self.count as f64 / self.of as f64
    }

    /// Wilson's 95 % interval (E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209): unlike that from the plain standard error, it
    /// keeps its coverage near 0 and 1.
    pub fn band(&self) -> [f64; 2] {
        let (n, p, z) = (self.of as f64, self.value(), HALF_WIDTH);
        if self.of == 0 {
            return [0.0, 1.0];
        }
        let (centre, half) = (p + z * z / (2.0 * n), z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt());
        [(centre - half) / (1.0 + z * z / n), (centre + half) / (1.0 + z * z / n)].map(|v| v.clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Tabulated interval of the median (Conover, Practical Nonparametric Statistics): the 6th and 15th of 20 values.
    #[test]
    fn the_band_of_a_median_is_that_of_the_tables() {
        assert_eq!(quantile_band(20, 0.5), [Some(6), Some(15)]);
        assert_eq!(quantile_band(5, 0.5), [None, None]);
        assert_eq!(quantile_band(6, 0.5), [Some(1), Some(6)]);
        assert_eq!(quantile_band(0, 0.5), [None, None]);
    }

    /// Wilson's interval by hand: 1 of 10, z = 1.96: 0.0179 to 0.4042 (Brown, Cai, DasGupta, Statist. Sci. 16 (2001) 101).
    #[test]
    fn the_band_of_a_share_is_wilsons() {
        let [low, high] = Share { count: 1, of: 10 }.band();
        assert!((low - 0.0179).abs() < 5e-5 && (high - 0.4042).abs() < 5e-5, "{low} {high}");
        let none = Share { count: 0, of: 50 }.band();
        assert!(none[0].abs() < 1e-15 && none[1] > 0.05);
    }

    /// In 4,000 studies a share of 95 % has a standard error of 0.35 %; four of them are exceeded by chance once in 15,000.
    #[test]
    fn bands_hold_what_they_promise() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        /// Number of simulated studies: the coverage has a standard error of 0.35 % at 95 %.
        const STUDIES: usize = 4000;
        for share in [0.05, 0.25, 0.5, 0.95] {
            let n = 200;
            let [Some(low), Some(high)] = quantile_band(n, share) else { unreachable!("200 values bound it") };
            let (mut held, mut shares_held) = (0, 0);
            for _ in 0..STUDIES {
                let mut values: Vec<f64> = (0..n).map(|_| random.random()).collect();
                values.sort_by(f64::total_cmp);
                // For numbers uniform on 0 to 1 the quantile is the share itself.
                held += usize::from(values[low as usize - 1] <= share && share <= values[high as usize - 1]);
                let count = values.iter().filter(|v| **v < share).count() as u64;
                let [least, most] = Share { count, of: n }.band();
                shares_held += usize::from(least <= share && share <= most);
            }
            let held = held as f64 / STUDIES as f64;
            assert!(held > 0.95 - 0.014, "quantile {share}: {held}");
            // Counts are integers: Wilson's interval covers 95 % on average over shares, and within 2.5 % of it at these.
            let shares_held = shares_held as f64 / STUDIES as f64;
            assert!((shares_held - 0.95).abs() < 0.025 + 0.014, "share {share}: {shares_held}");
        }
    }
}
