//! Forecast of planned measurements: the chance that they will name the effect, and the remaining error of the robot.

pub use super::prospect::Prospect;
pub use super::rival::Rival;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::candidate_covariances::{CandidateCovariances, best_free, blocks};
use super::length::expected_length;
use super::rival::State;
use crate::identify::fit::FitError;
use crate::math::linalg::{self, LinalgError};
use crate::math::positive_definite::cholesky;

/// Number of data sets sampled under each rival; the chances below have a standard error of about 2 %.
const DRAWS: usize = 500;

/// Probability from which on a credible set consists of one effect alone.
const RESOLVED: f64 = 0.95;

/// Forecast of how well the effect will be named.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// Expected probability of the effect that is truly missing.
    pub truth: f64,
    /// Chance that the credible set will consist of the right effect alone.
    pub resolved: f64,
}

/// Predictive distribution of the measurements under a rival: normal.
struct PredictiveDistribution {
    mean: DVector<f64>,
    /// Cholesky factor of the covariance, and the logarithm of the square root of its determinant.
    factor: Cholesky<f64, Dyn>,
    log_root: f64,
}

impl PredictiveDistribution {
    /// Log-likelihood of data that another rival generates from standard `normal` numbers, one value per column, up to
    /// a constant common to all rivals.
    fn log_likelihoods(&self, of_truth: &PredictiveDistribution, normal: &DMatrix<f64>) -> Vec<f64> {
        // L_b^-1 (L_a n + m_a - m_b): L_b^-1 L_a is computed once, rather than a solution for every draw.
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
    /// Forecast without further measurements.
    pub(super) fn now(weights: &[f64]) -> Self {
        let best = weights.iter().copied().fold(0.0, f64::max);
        Forecast { truth: weights.iter().map(|w| w * w).sum(), resolved: if best >= RESOLVED { best } else { 0.0 } }
    }

    /// Forecast after measurements with these columns of a pool, three per measurement.
    ///
    /// Data are sampled from each rival's predictive distribution, including its own uncertainty, and judged by Bayes'
    /// rule as in a diagnosis: `P(b | y) ~ pi_b N(y; X_b theta_b, I + X_b P_b X_b^T)`. The average over the draws
    /// accounts for data that mislead.
    pub(super) fn after(states: &[State], weights: &[f64], columns: &DMatrix<f64>, seed: u64) -> Result<Self, FitError> {
        let size = columns.ncols();
        let side = |state: &State| -> Result<PredictiveDistribution, FitError> {
            let x = columns.select_rows(&state.rows);
            let spread = DMatrix::identity(size, size) + x.tr_mul(&(&state.covariance * &x));
            let factor = cholesky(spread)?;
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

/// Uncertainty of the errors over the workspace, expressed by independent standard normal parameters.
pub(super) struct WorkspaceErrors {
    /// Jacobian of the errors: three rows per pose (m), one column per parameter.
    fields: DMatrix<f64>,
    /// `V^T V` with the Jacobian V: weights of the parameters in the sum of squares over the workspace.
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

    /// Mean over the workspace of the expected length of the error, m, after the covariance of the parameters has been
    /// reduced by `u u^T` for every `u` of `gains`. These parameters are the first rows of each `u`.
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

/// Error of the robot over the workspace that remains when the whole library is fitted to the data, and the choice of
/// the measurements that reduce it most (I-optimality: smallest `tr(V P V^T)`).
///
/// Parameters beyond those of the workspace errors, such as the pose of a moved artifact, affect only the candidates.
pub(super) struct WorkspaceOutlook<'a> {
    errors: &'a WorkspaceErrors,
    sighting: CandidateCovariances,
    choice: Option<Choice>,
}

/// Data on the candidates, needed only for choosing.
struct Choice {
    /// `A = V^T V`, extended to all parameters by zeros.
    weights: DMatrix<f64>,
    /// `X P A P X^T` of each candidate: the square of its covariance with the errors.
    worth: Vec<Matrix3<f64>>,
}

impl<'a> WorkspaceOutlook<'a> {
    /// From a pool's columns times a root of the covariance: parameters x 3 per candidate.
    pub fn new(errors: &'a WorkspaceErrors, candidates: DMatrix<f64>) -> Self {
        WorkspaceOutlook { errors, sighting: CandidateCovariances::of_unit(candidates), choice: None }
    }

    /// As [`WorkspaceOutlook::new`], prepared for choosing.
    pub fn to_choose(errors: &'a WorkspaceErrors, candidates: DMatrix<f64>) -> Self {
        let numbers = candidates.nrows();
        let weights = errors.weights.clone().resize(numbers, numbers, 0.0);
        let weighed = linalg::product_of_transposed(&weights, &candidates);
        let worth = blocks(&candidates, &weighed).collect();
        WorkspaceOutlook { choice: Some(Choice { weights, worth }), ..WorkspaceOutlook::new(errors, candidates) }
    }

    /// Reduction of the sum of squares over the workspace by a candidate: `tr((I + X P X^T)^-1 X P A P X^T)`.
    ///
    /// # Errors
    /// As [`CandidateCovariances::precision`].
    fn gain(&self, worth: &Matrix3<f64>, candidate: usize) -> Result<f64, LinalgError> {
        Ok(self.sighting.precision(candidate)?.dot(worth))
    }

    /// Takes the candidate that reduces the error most among those not `taken`; `None` if all are.
    ///
    /// # Errors
    /// As [`CandidateCovariances::precision`].
    pub fn choose(&mut self, taken: &[usize]) -> Result<Option<usize>, LinalgError> {
        let Some(Choice { worth, .. }) = &self.choice else { return Ok(None) };
        let best = best_free(worth.len(), taken, |i| self.gain(&worth[i], i))?;
        best.map_or(Ok(()), |best| self.take(best))?;
        Ok(best)
    }

    /// Updates the covariances with a candidate.
    ///
    /// `(P - u u^T) A (P - u u^T) = P A P - w u^T - u w^T` with `w = P A u - u (u^T A u) / 2`.
    ///
    /// # Errors
    /// As [`CandidateCovariances::precision`].
    pub fn take(&mut self, candidate: usize) -> Result<(), LinalgError> {
        let (gain, _) = self.sighting.gain(candidate)?;
        let Some(Choice { weights, worth }) = &mut self.choice else {
            self.sighting.learn(gain, None);
            return Ok(());
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
        Ok(())
    }

    /// Mean over the workspace of the expected length of the error, m.
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

    /// Two equally probable rivals whose predictions of one datum differ by d: `resolved` is `Phi(d/2 - ln 19 / d)`,
    /// the probability that the log odds, normal with mean d²/2 and variance d², exceed ln 19.
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

    /// One parameter of variance 4 with the same effect on candidate and workspace: a measurement of variance 1 reduces
    /// it to 0.8.
    #[test]
    fn what_is_measured_is_no_longer_wrong() {
        let mut candidates = DMatrix::zeros(2, 6);
        (candidates[(0, 0)], candidates[(1, 4)]) = (2.0, 1.0);
        let mut fields = DMatrix::zeros(3, 2);
        fields[(1, 0)] = 2.0;
        let errors = WorkspaceErrors::new(fields);
        let length = |variance: f64| (2.0 * variance / std::f64::consts::PI).sqrt();
        let mut forecast = WorkspaceOutlook::to_choose(&errors, candidates);
        let worth_of = |o: &WorkspaceOutlook<'_>| o.gain(&o.choice.as_ref().unwrap().worth[0], 0).unwrap();
        assert!((forecast.mean() - length(4.0)).abs() < 1e-14);
        // It reduces 4 to 0.8.
        assert!((worth_of(&forecast) - 3.2).abs() < 1e-14);
        assert_eq!(forecast.choose(&[]), Ok(Some(0)));
        assert!((forecast.mean() - length(0.8)).abs() < 1e-14);
        // A repetition would reduce 0.8 to 0.8 / (0.8 + 1).
        assert!((worth_of(&forecast) - (0.8 - 0.8 / 1.8)).abs() < 1e-14);
        assert_eq!(forecast.choose(&[0]), Ok(Some(1)));
        assert!((forecast.mean() - length(0.8)).abs() < 1e-14);
    }
}
