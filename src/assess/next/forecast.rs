//! What is to be expected of measurements before they are made: whether they will name the effect, and how wrong the robot will still be.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::candidate_covariances::{CandidateCovariances, best_free, blocks};
use super::length::expected_length;
use super::rival::State;
use crate::identify::FitError;
use crate::math::linalg;

/// Draws of the data under each rival; the chances below are known to 2 %.
const DRAWS: usize = 500;

/// Probability at which a credible set is one effect alone.
const RESOLVED: f64 = 0.95;

/// What is to be expected of naming the effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// Probability that the effect which is truly missing will have.
    pub truth: f64,
    /// Chance that the credible set will be one effect, and the right one.
    pub resolved: f64,
}

/// What a rival says that measurements will show: normal.
struct PredictiveDistribution {
    mean: DVector<f64>,
    /// Of its covariance, and the logarithm of the root of its determinant.
    factor: Cholesky<f64, Dyn>,
    log_root: f64,
}

impl PredictiveDistribution {
    /// Logarithm of the likelihood of data that another drew from unit `normal` numbers, each column, but for what is the same for all.
    fn log_likelihoods(&self, of_truth: &PredictiveDistribution, normal: &DMatrix<f64>) -> Vec<f64> {
        // L_b^-1 (L_a n + m_a - m_b): the draws turned at once, in place of every datum's solution.
        let mut turned = of_truth.factor.l();
        self.factor.l_dirty().solve_lower_triangular_mut(&mut turned);
        let mut apart = &of_truth.mean - &self.mean;
        self.factor.l_dirty().solve_lower_triangular_mut(&mut apart);
        let mut off = linalg::product(&turned, normal);
        off.column_iter_mut().for_each(|mut y| y += &apart);
        off.column_iter().map(|y| -0.5 * y.norm_squared() - self.log_root).collect()
    }
}

impl Forecast {
    /// As things stand.
    pub(super) fn now(weights: &[f64]) -> Self {
        let best = weights.iter().copied().fold(0.0, f64::max);
        Forecast { truth: weights.iter().map(|w| w * w).sum(), resolved: if best >= RESOLVED { best } else { 0.0 } }
    }

    /// After the measurements of these columns (of a pool, three each).
    ///
    /// Data are drawn as each rival predicts them, its own uncertainty included, and judged by Bayes' rule as a diagnosis would:
    /// `P(b | y) ~ pi_b N(y; X_b theta_b, I + X_b P_b X_b^T)`. Averaging over the draws takes in that a measurement may also mislead.
    pub(super) fn after(states: &[State], weights: &[f64], columns: &DMatrix<f64>, seed: u64) -> Result<Self, FitError> {
        let size = columns.ncols();
        let side = |state: &State| -> Result<PredictiveDistribution, FitError> {
            let x = columns.select_rows(&state.rows);
            let spread = DMatrix::identity(size, size) + x.tr_mul(&(&state.covariance * &x));
            let factor = Cholesky::new(spread).ok_or(FitError::Singular)?;
            let log_root = factor.l_dirty().diagonal().iter().map(|l| l.ln()).sum();
            Ok(PredictiveDistribution { mean: x.tr_mul(&state.mean), factor, log_root })
        };
        let sides = states.iter().map(side).collect::<Result<Vec<_>, _>>()?;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normal = DMatrix::<f64>::from_fn(size, DRAWS, |_, _| StandardNormal.sample(&mut random));
        let of_truth = |a: usize| {
            let all: Vec<Vec<f64>> = sides.iter().map(|side| side.log_likelihoods(&sides[a], &normal)).collect();
            let mut forecast = Forecast { truth: 0.0, resolved: 0.0 };
            for draw in 0..DRAWS {
                let log: Vec<f64> = all.iter().zip(weights).map(|(l, w)| l[draw] + w.ln()).collect();
                let largest = log.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let own = (log[a] - largest).exp() / log.iter().map(|l| (l - largest).exp()).sum::<f64>();
                forecast.truth += own / DRAWS as f64;
                forecast.resolved += if own >= RESOLVED { 1.0 / DRAWS as f64 } else { 0.0 };
            }
            forecast
        };
        let each: Vec<Forecast> = (0..states.len()).into_par_iter().map(of_truth).collect();
        let mean = |of: fn(&Forecast) -> f64| each.iter().zip(weights).map(|(o, w)| w * of(o)).sum();
        Ok(Forecast { truth: mean(|o| o.truth), resolved: mean(|o| o.resolved) })
    }
}

/// Errors over the workspace, as far as the data leave them open: those of independent unit normal numbers.
pub(super) struct WorkspaceErrors {
    /// Errors x numbers, three rows a pose, m.
    fields: DMatrix<f64>,
    /// `V^T V` of these: what each number weighs in the sum of squares over the workspace.
    weights: DMatrix<f64>,
    /// Covariance at each pose, m².
    covariances: Vec<Matrix3<f64>>,
}

impl WorkspaceErrors {
    pub fn new(fields: DMatrix<f64>) -> Self {
        let transposed = fields.transpose();
        let mut weights = DMatrix::zeros(fields.ncols(), fields.ncols());
        linalg::normal_matrix(&transposed, &mut weights);
        WorkspaceErrors { weights, covariances: blocks(&transposed, &transposed).collect(), fields }
    }

    /// Expected length of the error, mean over the workspace, when of the numbers' covariance `u u^T` has been taken for every `u` of
    /// `gains` (of which these numbers are the first), m.
    pub fn mean_after<'g>(&self, gains: impl ExactSizeIterator<Item = &'g DMatrix<f64>>) -> f64 {
        let mut all = DMatrix::zeros(self.fields.ncols(), 3 * gains.len());
        for (k, gain) in gains.enumerate() {
            all.columns_mut(3 * k, 3).copy_from(&gain.rows(0, self.fields.ncols()));
        }
        let seen = linalg::product(&self.fields, &all);
        let left = |(p, covariance): (usize, &Matrix3<f64>)| {
            let seen = seen.fixed_rows::<3>(3 * p);
            expected_length(&(covariance - seen * seen.transpose()))
        };
        self.covariances.iter().enumerate().map(left).sum::<f64>() / self.covariances.len().max(1) as f64
    }
}

/// How wrong the robot will still be over the workspace when the whole library is fitted to the data, and what lowers that most
/// (I-optimality: least `tr(V P V^T)`).
///
/// Numbers beyond those of the workspace's errors, as where a moved artifact stands, move the candidates alone.
pub(super) struct WorkspaceOutlook<'a> {
    errors: &'a WorkspaceErrors,
    sighting: CandidateCovariances,
    choice: Option<Choice>,
}

/// What is kept of the candidates as long as one is to be chosen.
struct Choice {
    /// `A = V^T V`, of all numbers.
    weights: DMatrix<f64>,
    /// `X P A P X^T` of each candidate: its covariance with the errors, squared.
    worth: Vec<Matrix3<f64>>,
}

impl<'a> WorkspaceOutlook<'a> {
    /// Of a pool's columns times a root of the covariance: numbers x 3 candidates.
    pub fn new(errors: &'a WorkspaceErrors, candidates: DMatrix<f64>) -> Self {
        WorkspaceOutlook { errors, sighting: CandidateCovariances::of_unit(candidates), choice: None }
    }

    /// The same, to choose from.
    pub fn to_choose(errors: &'a WorkspaceErrors, candidates: DMatrix<f64>) -> Self {
        let numbers = candidates.nrows();
        let weights = errors.weights.clone().resize(numbers, numbers, 0.0);
        let weighed = linalg::product_of_transposed(&weights, &candidates);
        let worth = blocks(&candidates, &weighed).collect();
        WorkspaceOutlook { choice: Some(Choice { weights, worth }), ..WorkspaceOutlook::new(errors, candidates) }
    }

    /// By how much a candidate lowers the sum of squares over the workspace: `tr((I + X P X^T)^-1 X P A P X^T)`.
    fn gain(&self, worth: &Matrix3<f64>, candidate: usize) -> f64 {
        self.sighting.precision(candidate).dot(worth)
    }

    /// Takes the candidate that lowers it most among those not taken; `None` when all are.
    pub fn choose(&mut self, taken: &[usize]) -> Option<usize> {
        let Choice { worth, .. } = self.choice.as_ref()?;
        let best = best_free(worth.len(), taken, |i| self.gain(&worth[i], i))?;
        self.take(best);
        Some(best)
    }

    /// Learns from a candidate.
    ///
    /// `(P - u u^T) A (P - u u^T) = P A P - w u^T - u w^T` with `w = P A u - u (u^T A u) / 2`.
    pub fn take(&mut self, candidate: usize) {
        let (gain, _) = self.sighting.gain(candidate);
        let Some(Choice { weights, worth }) = &mut self.choice else {
            self.sighting.learn(gain, None);
            return;
        };
        let weighed = linalg::product(weights, &gain);
        let mut turned = weighed.clone();
        for earlier in self.sighting.gains() {
            turned.gemm(-1.0, earlier, &earlier.tr_mul(&weighed), 1.0);
        }
        turned.gemm(-0.5, &gain, &gain.tr_mul(&weighed), 1.0);
        let lesson = self.sighting.learn(gain, Some(turned));
        for (i, worth) in worth.iter_mut().enumerate() {
            let cross = lesson.seen(i, 1) * lesson.seen(i, 0).transpose();
            *worth -= cross + cross.transpose();
        }
    }

    /// Expected length of the error, mean over the workspace, m.
    pub fn mean(&self) -> f64 {
        self.errors.mean_after(self.sighting.gains())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(row: usize, mean: f64) -> State {
        State { rows: vec![row], mean: DVector::from_element(1, mean), covariance: DMatrix::zeros(1, 1) }
    }

    /// Two equally likely rivals whose predictions of one datum are apart by d: resolved is `Phi(d/2 - ln 19 / d)`, the chance that the
    /// logarithm of the odds, normal with mean d²/2 and variance d², exceeds ln 19.
    #[test]
    fn the_chance_to_resolve_two_by_hand() {
        let mut columns = DMatrix::zeros(2, 3);
        columns[(0, 0)] = 1.0;
        let forecast = Forecast::after(&[state(0, 4.0), state(1, 0.0)], &[0.5, 0.5], &columns, 1).unwrap();
        // Phi(2 - 0.7361) = 0.8968
        assert!((forecast.resolved - 0.8968).abs() < 0.03, "{}", forecast.resolved);
        let nothing = Forecast::after(&[state(0, 0.0), state(1, 0.0)], &[0.7, 0.3], &columns, 1).unwrap();
        assert!((nothing.truth - 0.58).abs() < 1e-12 && nothing.resolved == 0.0);
        assert_eq!(Forecast::now(&[0.7, 0.3]).resolved, 0.0);
    }

    /// One number of variance 4 that moves candidate and workspace alike: measured with variance 1, 0.8 is left.
    #[test]
    fn what_is_measured_is_no_longer_wrong() {
        let mut candidates = DMatrix::zeros(2, 6);
        (candidates[(0, 0)], candidates[(1, 4)]) = (2.0, 1.0);
        let mut fields = DMatrix::zeros(3, 2);
        fields[(1, 0)] = 2.0;
        let errors = WorkspaceErrors::new(fields);
        let length = |variance: f64| (2.0 * variance / std::f64::consts::PI).sqrt();
        let mut forecast = WorkspaceOutlook::to_choose(&errors, candidates);
        let worth_of = |o: &WorkspaceOutlook<'_>| o.gain(&o.choice.as_ref().unwrap().worth[0], 0);
        assert!((forecast.mean() - length(4.0)).abs() < 1e-14);
        // It lowers 4 to 0.8.
        assert!((worth_of(&forecast) - 3.2).abs() < 1e-14);
        assert_eq!(forecast.choose(&[]), Some(0));
        assert!((forecast.mean() - length(0.8)).abs() < 1e-14);
        // Once more it would lower 0.8 to 0.8 / (0.8 + 1).
        assert!((worth_of(&forecast) - (0.8 - 0.8 / 1.8)).abs() < 1e-14);
        assert_eq!(forecast.choose(&[0]), Some(1));
        assert!((forecast.mean() - length(0.8)).abs() < 1e-14);
    }
}
