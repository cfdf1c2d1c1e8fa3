//! Serial correlation of the residuals, caused by drift or by sequences of neighbouring poses.

use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal};

use super::Row;

/// False-alarm rate over all lags.
pub(crate) const SERIAL_LEVEL: f64 = 1e-3;

/// Lags tested, in postures.
const LAGS: [usize; 4] = [1, 2, 4, 8];

/// Number of random orders that determine the correlation expected by chance.
const ORDERS: usize = 200;

/// Fewest postures for a test.
const FEWEST: usize = 20;

/// Correlation at one lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LagCorrelation {
    /// Distance in postures.
    pub lag: usize,
    /// Correlation of the whitened residuals.
    pub correlation: f64,
    /// Its deviation from the mean over random orders, in one-sigmas of those.
    pub z: f64,
}

/// Correlation of the residuals in the order of measurement.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SerialCorrelation {
    /// One entry per lag (1, 2, 4, 8); none with fewer than 20 postures.
    pub lags: Vec<LagCorrelation>,
    /// Probability of so large a positive correlation at any lag in a random order (normal approximation, Bonferroni).
    pub p: f64,
}

impl SerialCorrelation {
    /// Tests rows in the order of measurement; consecutive rows of one posture count as one.
    pub(crate) fn of(rows: &[Row], postures: &[usize]) -> Self {
        let runs = runs(rows, postures);
        if runs.iter().map(Vec::len).sum::<usize>() < FEWEST {
            return SerialCorrelation { lags: Vec::new(), p: 1.0 };
        }
        let seen = correlations(&runs);
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let mut shuffled = runs.clone();
        let (mut sum, mut squares) = ([0.0; 4], [0.0; 4]);
        for _ in 0..ORDERS {
            shuffled.iter_mut().for_each(|run| run.shuffle(&mut random));
            for (k, c) in correlations(&shuffled).into_iter().enumerate() {
                sum[k] += c;
                squares[k] += c * c;
            }
        }
        let n = ORDERS as f64;
        let of_lag = |k: usize| {
            let mean = sum[k] / n;
            let sigma = ((squares[k] / n - mean * mean).max(0.0) * n / (n - 1.0)).sqrt();
            let z = if sigma > 0.0 { (seen[k] - mean) / sigma } else { 0.0 };
            LagCorrelation { lag: LAGS[k], correlation: seen[k], z }
        };
        let lags: Vec<LagCorrelation> = (0..LAGS.len()).map(of_lag).collect();
        let largest = lags.iter().map(|l| l.z).fold(f64::NEG_INFINITY, f64::max);
        let p = Normal::new(0.0, 1.0).map_or(1.0, |d| (d.sf(largest) * LAGS.len() as f64).min(1.0));
        SerialCorrelation { lags, p }
    }

    /// True if the residuals are correlated in the order of measurement, at a false-alarm rate of 1 in 1,000.
    pub fn is_significant(&self) -> bool {
        self.p < SERIAL_LEVEL
    }

    /// The lag with the largest `z`.
    pub fn largest(&self) -> Option<LagCorrelation> {
        self.lags.iter().copied().max_by(|a, b| a.z.total_cmp(&b.z))
    }
}

/// Mean whitened residuals of consecutive rows at one posture, in order, for each set-up.
fn runs(rows: &[Row], postures: &[usize]) -> Vec<Vec<[f64; 3]>> {
    let setups = rows.iter().map(|r| r.setup + 1).max().unwrap_or(0);
    let mut runs: Vec<Vec<([f64; 3], f64, usize)>> = vec![Vec::new(); setups];
    for (row, &posture) in rows.iter().zip(postures) {
        let run = &mut runs[row.setup];
        match run.last_mut() {
            Some((sum, count, at)) if *at == posture => {
                (0..3).for_each(|k| sum[k] += row.whitened[k]);
                *count += 1.0;
            }
            _ => run.push((row.whitened.into(), 1.0, posture)),
        }
    }
    let mean = |(sum, count, _): ([f64; 3], f64, usize)| sum.map(|x| x / count);
    runs.into_iter().map(|run| run.into_iter().map(mean).collect()).collect()
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn correlations(runs: &[Vec<[f64; 3]>]) -> [f64; 4] {
    let (mut squares, mut count) = (0.0, 0.0);
    for x in runs.iter().flatten() {
        squares += dot(x, x);
        count += 1.0;
    }
    LAGS.map(|lag| {
        let pairs = || runs.iter().flat_map(|run| run.iter().zip(run.iter().skip(lag)));
        let sum: f64 = pairs().map(|(a, b)| dot(a, b)).sum();
        let of: f64 = runs.iter().map(|run| run.len().saturating_sub(lag) as f64).sum();
        if of > 0.0 && squares > 0.0 { sum / of / (squares / count) } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use rand::RngExt;

    fn normal(random: &mut ChaCha8Rng) -> f64 {
        (0..12).map(|_| random.random_range(0.0..1.0)).sum::<f64>() - 6.0
    }

    fn test_of(random: &mut ChaCha8Rng, memory: f64) -> SerialCorrelation {
        let mut last = Vector3::zeros();
        let rows: Vec<Row> = (0..80)
            .map(|k| {
                last = memory * last + (1.0 - memory * memory).sqrt() * Vector3::from_fn(|_, _| normal(random));
                Row { setup: 0, first_row: 3 * k, height: 3, rows: 3, whitened: last, variance: 1.0 }
            })
            .collect();
        SerialCorrelation::of(&rows, &(0..80).collect::<Vec<usize>>())
    }

    #[test]
    fn a_random_order_raises_an_alarm_as_rarely_as_claimed() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let p: Vec<f64> = (0..2000).map(|_| test_of(&mut random, 0.0).p).collect();
        let below = |level: f64| p.iter().filter(|p| **p < level).count();
        // 2 and at most 100 are expected; the lags are nearly independent, so Bonferroni's correction costs little.
        assert!(below(SERIAL_LEVEL) <= 8, "{}", below(SERIAL_LEVEL));
        assert!((50..=140).contains(&below(0.05)), "{}", below(0.05));
    }

    #[test]
    fn a_memory_of_a_third_is_seen() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let seen = (0..50).filter(|_| test_of(&mut random, 0.35).is_significant()).count();
        assert!(seen >= 40, "{seen}");
    }
}
