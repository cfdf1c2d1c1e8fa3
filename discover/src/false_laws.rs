//! How good a law chance finds: the same search in simulated residuals without one.
//!
//! They have what is known of the residuals: the distribution of what the best law leaves, its correlation from one sample to the
//! next, and a background of ordinary size.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::field::Field;
use crate::metric::{Ground, Metrics, SIZES};

/// Number of simulated residuals: the parameters of the distribution of their best laws are known to a tenth.
const SIMULATED: usize = 100;

/// Fixed seed: the same data give the same figures.
const SEED: u64 = 0x0d15_c0e5;

/// Euler's constant: mean of a standard Gumbel distribution.
const EULER: f64 = 0.577_215_664_901_532_9;

/// Probability below which the simulated searches say nothing.
const RAREST: f64 = 1e-4;

/// Correlation beyond which residuals are a walk, and no longer noise.
const MOST_CORRELATED: f64 = 0.98;

/// The residuals without the best law, and what makes residuals like them.
pub(crate) struct Nothing {
    /// Innovations of every sample.
    innovations: Vec<DVector<f64>>,
    /// Correlation from one sample to the next.
    correlation: f64,
    /// Root mean square.
    sigma: f64,
    /// Index of the background's size.
    size: usize,
}

impl Nothing {
    /// What is known of the residuals if a law with these columns (residuals x columns) is in them.
    pub fn beside(field: &Field<'_>, ground: &Ground, metrics: &Metrics, law: &DMatrix<f64>) -> Self {
        let size = metrics.likely_size(law);
        let metric = &metrics.of_size[size];
        let data = ground.series.column(0).into_owned();
        let rest = match metric.seen_columns(law) {
            Some(seen) => data - law * seen.coefficients(),
            None => data,
        };
        let rest = &rest - &metric.u * metric.u.tr_mul(&rest);
        let kept = rest.len() as f64 - metric.u.norm_squared() - law.ncols() as f64;
        let rest = rest * (ground.series.nrows() as f64 / kept.max(1.0)).sqrt();
        let of: Vec<DVector<f64>> = field.spans.iter().map(|rows| rest.rows(rows.start, rows.len()).into_owned()).collect();
        let pairs = of.windows(2).filter(|p| p[0].len() == p[1].len());
        let (along, whole) = pairs.fold((0.0, 0.0), |(a, w), p| (a + p[0].dot(&p[1]), w + p[0].norm_squared()));
        let correlation = if whole > 0.0 { (along / whole).clamp(0.0, MOST_CORRELATED) } else { 0.0 };
        let innovations = (0..of.len())
            .map(|i| if i > 0 && of[i - 1].len() == of[i].len() { &of[i] - &of[i - 1] * correlation } else { of[i].clone() })
            .collect();
        let numbers = field.spans.iter().map(ExactSizeIterator::len).sum::<usize>().max(1) as f64;
        let sigma = (of.iter().map(|v| v.norm_squared()).sum::<f64>() / numbers).sqrt();
        Nothing { innovations, correlation, sigma, size }
    }

    /// Residuals like them without a law.
    fn simulated(&self, field: &Field<'_>, ground: &Ground, random: &mut ChaCha8Rng) -> DVector<f64> {
        let background = ground.of_background(SIZES[self.size] * self.sigma, || StandardNormal.sample(random));
        let mut series = background;
        let mut before: Option<DVector<f64>> = None;
        for (i, rows) in field.spans.iter().enumerate() {
            let same: Vec<usize> = (0..self.innovations.len()).filter(|&k| self.innovations[k].len() == rows.len()).collect();
            let drawn = same.get(random.random_range(0..same.len().max(1))).copied().unwrap_or(i);
            let mut now = self.innovations[drawn].map(|x| if random.random::<bool>() { x } else { -x });
            if let Some(before) = before.filter(|b| b.len() == now.len()) {
                now.axpy(self.correlation, &before, 1.0);
            }
            let mut part = series.rows_mut(rows.start, rows.len());
            part += &now;
            before = Some(now);
        }
        series
    }

    /// Probability that a search finds a law with these log odds, or larger ones, where there is none.
    pub fn p_of(&self, field: &Field<'_>, ground: &Ground, ln_odds: f64) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let all: Vec<DVector<f64>> = (0..SIMULATED).map(|_| self.simulated(field, ground, &mut random)).collect();
        let simulated = ground.with(&DMatrix::from_columns(&all));
        let found = field.search(&simulated.metrics(), false).of_series;
        let n = found.len() as f64;
        let mean = found.iter().sum::<f64>() / n;
        let sd = (found.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let spread = sd * 6.0f64.sqrt() / std::f64::consts::PI;
        let place = mean - EULER * spread;
        (-(-(-(ln_odds - place) / spread.max(f64::MIN_POSITIVE)).exp()).exp_m1()).max(RAREST)
    }
}
