//! The size of a drift: the variance of the steps that a parameter makes from run to run, in proportion to the time between them.
//!
//! The most likely size is by restricted likelihood. The limit is the drift at which steps as small as those observed would occur in only
//! one case in twenty: their sum of squares, each in units of its variance at that drift, is a chi-square. The likelihood ratio alone would
//! hold for many runs, and in nine cases of ten for three.

use nalgebra::{DMatrix, DVector};

use super::products::Reduced;
use crate::residuals::noise_floor::chi2_chance;

/// Twice the log likelihood ratio at the one-sided limit of 95 % for many runs (chi-square of one degree of freedom at 90 %).
const LIMIT: f64 = 2.706;

/// Level of the limit (docs/runs.md).
const LEVEL: f64 = 0.95;

/// Number of sizes tried: from the smallest that could be seen over eight decades.
const STEPS: usize = 97;
/// Number of sizes tried per decade.
const A_DECADE: f64 = 12.0;

/// A drift as a random walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// One sigma of the change in a month, SI: the most likely one.
    pub monthly: f64,
    /// It is smaller than this at a level of 95 %.
    pub at_most: f64,
}

impl Drift {
    /// Estimates the drift of one column with residuals of the variance `unit`; `None` if the runs show nothing of it.
    pub(super) fn of(reduced: &Reduced, unit: f64, column: usize, months: &[f64]) -> Option<Drift> {
        let (gram, along) = reduced.increments(column);
        let root = DVector::from_iterator(gram.nrows(), months.windows(2).map(|w| (w[1] - w[0]).max(0.0).sqrt()));
        let scaled = DMatrix::from_fn(gram.nrows(), gram.ncols(), |r, c| root[r] * gram[(r, c)] * root[c] / unit);
        let eigen = scaled.symmetric_eigen();
        let seen = eigen.eigenvectors.tr_mul(&along.component_mul(&root)) / unit.sqrt();
        let most = eigen.eigenvalues.max();
        if most.is_nan() || most <= 0.0 {
            return None;
        }
        // What the runs do not show has no size.
        let steps = eigen.eigenvalues.iter().zip(&seen).filter(|(l, _)| **l > NOTHING * most);
        Some(Drift::of_steps(&steps.map(|(&l, u)| [l, u / l.sqrt()]).collect::<Vec<_>>()))
    }

    /// From independent steps: the variance that a drift of one unit a month adds to each, in units of its noise, and the step in the
    /// same units.
    fn of_steps(steps: &[[f64; 2]]) -> Drift {
        let most = steps.iter().map(|[l, _]| *l).fold(0.0, f64::max);
        let smallest = 0.01 / most.sqrt();
        let likelihood = |size: f64| -> f64 {
            let of = |[l, z]: &[f64; 2]| {
                let variance = 1.0 + size * size * l;
                -0.5 * (z * z / variance + variance.ln())
            };
            steps.iter().map(of).sum()
        };
        // Probability of larger steps.
        let chance = |size: f64| {
            let squares = steps.iter().map(|[l, z]| z * z / (1.0 + size * size * l)).sum();
            chi2_chance(squares, steps.len() as f64).unwrap_or(1.0)
        };
        let sizes: Vec<f64> =
            std::iter::once(0.0).chain((0..STEPS).map(|k| smallest * 10f64.powf(k as f64 / A_DECADE))).collect();
        let all: Vec<f64> = sizes.iter().map(|size| likelihood(*size)).collect();
        let best = (0..sizes.len()).max_by(|&a, &b| all[a].total_cmp(&all[b])).unwrap_or(0);
        let is_beyond = |k: &usize| 2.0 * (all[best] - all[*k]) > LIMIT && chance(sizes[*k]) > LEVEL;
        let beyond = (best..sizes.len()).find(is_beyond);
        Drift { monthly: sizes[best], at_most: beyond.map_or(f64::INFINITY, |k| sizes[k]) }
    }
}

/// Share of the best determined combination of steps below which one is undetermined.
const NOTHING: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Share of the campaigns in which a drift of `size` is below the limit, and the median of the limit.
    fn covered(variances: &[f64], size: f64) -> (f64, f64) {
        let mut rng = ChaCha8Rng::seed_from_u64(19);
        let mut limits: Vec<f64> = (0..4_000)
            .map(|_| {
                let step = |&l: &f64| {
                    let z: f64 = StandardNormal.sample(&mut rng);
                    [l, z * (1.0 + size * size * l).sqrt()]
                };
                Drift::of_steps(&variances.iter().map(step).collect::<Vec<_>>()).at_most
            })
            .collect();
        limits.sort_by(f64::total_cmp);
        (limits.iter().filter(|limit| **limit >= size).count() as f64 / limits.len() as f64, limits[limits.len() / 2])
    }

    /// Of 4,000 campaigns 95 % have a standard deviation of 0.35 %.
    #[test]
    fn a_limit_of_95_percent_holds_in_95_cases_of_100() {
        for variances in [vec![1.0; 2], vec![1.0, 0.2], vec![1.0; 5], vec![1.0, 1.0, 1.0, 0.01]] {
            for size in [0.0, 0.3, 1.0, 3.0, 30.0] {
                let (share, median) = covered(&variances, size);
                assert!(share > 0.939, "{variances:?}, {size}: {share}");
                // It is not a limit if it always holds.
                assert!(median < 8.0 * size.max(1.0), "{variances:?}, {size}: {median}");
            }
        }
    }
}
