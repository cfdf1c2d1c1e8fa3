//! The budget: each source of deviation alone, and all the others without it, over many tests.

use calibench::units::UM;
use rayon::prelude::*;

use super::{EXPECTED_UM, PrecisionError, PrecisionTest, Setup, Source, Sources, carry_out};
use crate::random::Streams;
use crate::study::{Share, quantile_band};

/// Half-width of a 95 % band, in sigmas.
const HALF_WIDTH: f64 = 1.96;

/// Root mean square of the distances between datum ball and master ball, over all repetitions of all tests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RootMeanSquare {
    /// It, m.
    pub value: f64,
    /// Its 95 % band, m: from the scatter of the tests' mean squares, which are independent; the repetitions of one test are not.
    pub band: [f64; 2],
}

impl RootMeanSquare {
    /// Of the mean squares (m²) of tests.
    fn of(mean_squares: &[f64]) -> Self {
        let n = mean_squares.len() as f64;
        let mean = mean_squares.iter().sum::<f64>() / n;
        let variance = mean_squares.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        let half = HALF_WIDTH * (variance / n).sqrt();
        RootMeanSquare { value: mean.sqrt(), band: [(mean - half).max(0.0).sqrt(), (mean + half).sqrt()] }
    }
}

/// What one source does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contribution {
    /// Which.
    pub source: Source,
    /// The deviation with it alone.
    pub alone: RootMeanSquare,
    /// The deviation with all but it.
    pub without: RootMeanSquare,
    /// Its mean square over the sum of all mean squares.
    pub share: f64,
}

/// How the largest deviation of a test spreads over tests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Largest {
    /// Median, m.
    pub median: f64,
    /// Its 95 % band, m, where there are tests enough.
    pub median_band: [Option<f64>; 2],
    /// Values that 5 % and 95 % of the tests stay below, m.
    pub range: [f64; 2],
    /// Tests in which it lies where it is expected.
    pub as_expected: Share,
}

impl Largest {
    /// Of the largest deviations (m) of tests; there is at least one.
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

/// What the deviation is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// Tests that each number is of.
    pub trials: u64,
    /// The deviation with all sources.
    pub total: RootMeanSquare,
    /// The sources one by one.
    pub contributions: Vec<Contribution>,
    /// Root sum square of the sources alone, m: the total, if they were independent and small.
    pub root_sum_square: f64,
    /// Largest distance in a test.
    pub largest: Largest,
    /// Largest deviation along any one axis in a test.
    pub largest_along_axis: Largest,
}

/// All tests of one set-up, in order; the least numbered failure wins, on any number of threads.
fn tests(setup: &Setup, seed: u64, trials: u64) -> Result<Vec<PrecisionTest>, PrecisionError> {
    let all: Vec<_> = (0..trials).into_par_iter().map(|trial| carry_out(setup, &Streams { seed, trial })).collect();
    all.into_iter().collect()
}

/// Makes the budget from `trials` tests (at least one) of every set of sources; test k meets the same draws in all of them. `done` is told
/// of each of the `1 + 2 * Source::ALL.len()` sets.
///
/// # Errors
/// The first failure that a test meets.
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
