//! The error budget: each source of deviation alone, and all others without it, over many tests.

use calibench::units::UM;
use rayon::prelude::*;

use super::{EXPECTED_UM, PrecisionError, PrecisionTest, Setup, Source, Sources, carry_out};
use crate::study::{Share, quantile_band};
use calibench_sim::random::Streams;

/// Half-width of a 95 % band, in standard deviations.
const HALF_WIDTH: f64 = 1.96;

/// Root mean square of the distances between datum ball and master ball, over all repetitions of all tests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RootMeanSquare {
    /// The root mean square, m.
    pub value: f64,
    /// Its 95 % band, m, from the scatter of the tests' mean squares: tests are independent, the repetitions of one test are
    /// not.
    pub band: [f64; 2],
}

impl RootMeanSquare {
    /// Computes it from the mean squares (m²) of tests.
    fn of(mean_squares: &[f64]) -> Self {
        let n = mean_squares.len() as f64;
        let mean = mean_squares.iter().sum::<f64>() / n;
        let variance = mean_squares.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        let half = HALF_WIDTH * (variance / n).sqrt();
        RootMeanSquare { value: mean.sqrt(), band: [(mean - half).max(0.0).sqrt(), (mean + half).sqrt()] }
    }
}

/// Contribution of one source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contribution {
    /// The source.
    pub source: Source,
    /// The deviation with this source alone.
    pub alone: RootMeanSquare,
    /// The deviation with all other sources.
    pub without: RootMeanSquare,
    /// Its mean square as a share of the sum over all sources.
    pub share: f64,
}

/// Distribution over tests of the largest deviation in a test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Largest {
    /// Median, m.
    pub median: f64,
    /// Its 95 % band, m; `None` if there are too few tests.
    pub median_band: [Option<f64>; 2],
    /// 5 % and 95 % quantiles, m.
    pub range: [f64; 2],
    /// Share of tests in which it lies in the expected range.
    pub as_expected: Share,
}

impl Largest {
    /// Computes it from the largest deviations (m) of at least one test.
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let quantile = |share: f64| values[((n as f64 * share) as usize).min(n - 1)];
        let rank = |rank: Option<u64>| rank.map(|r| values[r as usize - 1]);
        let [low, high] = EXPECTED_UM.map(|v| v * UM);
        Largest {
            median: 0.5 * (values[(n - 1) / 2] + values[n / 2]),
            median_band: quantile_band(n as u64, 0.5).map(rank),
            range: [quantile(0.05), quantile(0.95)],
            as_expected: Share { count: values.iter().filter(|v| (low..=high).contains(*v)).count() as u64, of: n as u64 },
        }
    }
}

/// The error budget.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// Number of tests behind each figure.
    pub trials: u64,
    /// The deviation with all sources.
    pub total: RootMeanSquare,
    /// The individual sources.
    pub contributions: Vec<Contribution>,
    /// Root sum square of the single sources, m: equals the total if they are independent and small.
    pub root_sum_square: f64,
    /// Largest distance in a test.
    pub largest: Largest,
    /// Largest deviation along any one axis in a test.
    pub largest_along_axis: Largest,
}

/// All tests of one set-up, in order; of several failures the one of lowest number is returned, whatever the number of threads.
fn tests(setup: &Setup, seed: u64, trials: u64) -> Result<Vec<PrecisionTest>, PrecisionError> {
    let all: Vec<_> = (0..trials).into_par_iter().map(|trial| carry_out(setup, &Streams { seed, trial })).collect();
    all.into_iter().collect()
}

/// Computes the budget from `trials` tests (at least one) of every set of sources; test k uses the same draws in all of them.
/// `done` is called after each of the `1 + 2 * Source::ALL.len()` sets.
///
/// # Errors
/// The first failure of a test.
pub fn budget(setup: &Setup, seed: u64, trials: u64, done: &dyn Fn()) -> Result<Budget, PrecisionError> {
    let trials = trials.max(1);
    let mean_squares = |sources: Sources| -> Result<RootMeanSquare, PrecisionError> {
        let all = tests(&setup.with(sources), seed, trials)?;
        done();
        Ok(RootMeanSquare::of(&all.iter().map(PrecisionTest::mean_square).collect::<Vec<f64>>()))
    };
    let all = tests(setup, seed, trials)?;
    done();
    let mut contributions = Vec::with_capacity(Source::ALL.len());
    for source in Source::ALL {
        let (alone, without) = (mean_squares(Sources::only(source))?, mean_squares(Sources::without(source))?);
        contributions.push(Contribution { source, alone, without, share: 0.0 });
    }
    let sum: f64 = contributions.iter().map(|c| c.alone.value.powi(2)).sum();
    for contribution in contributions.iter_mut().filter(|_| sum > 0.0) {
        contribution.share = contribution.alone.value.powi(2) / sum;
    }
    let along = |test: &PrecisionTest| (0..3).map(|k| test.largest_along(k)).fold(0.0, f64::max);
    Ok(Budget {
        trials,
        total: RootMeanSquare::of(&all.iter().map(PrecisionTest::mean_square).collect::<Vec<f64>>()),
        contributions,
        root_sum_square: sum.sqrt(),
        largest: Largest::of(all.iter().map(PrecisionTest::largest).collect()),
        largest_along_axis: Largest::of(all.iter().map(along).collect()),
    })
}
