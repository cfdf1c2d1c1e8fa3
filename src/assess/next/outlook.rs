//! What is to be expected of measurements before they are made: whether they will name the effect, and how wrong the robot will still be.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::rival::State;
use super::rivalry::first_largest;
use crate::identify::{FitError, linalg};

/// Draws of the data under each rival; the chances below are known to 2 %.
const DRAWS: usize = 500;

/// Probability at which a credible set is one effect alone.
const RESOLVED: f64 = 0.95;

/// What is to be expected of naming the effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlook {
    /// Probability that the effect which is truly missing will have.
    pub truth: f64,
    /// Chance that the credible set will be one effect, and the right one.
    pub resolved: f64,
}

/// What a rival says that measurements will show: normal.
struct Forecast {
    mean: DVector<f64>,
    /// Of its covariance, and the logarithm of the root of its determinant.
    factor: Cholesky<f64, Dyn>,
    log_root: f64,
}

impl Forecast {
    /// Logarithm of the likelihood of each column of data, but for what is the same for all rivals.
    fn log_likelihoods(&self, data: &DMatrix<f64>) -> Vec<f64> {
        let mut off = data.clone();
        off.column_iter_mut().for_each(|mut y| y -= &self.mean);
        self.factor.l_dirty().solve_lower_triangular_mut(&mut off);
        off.column_iter().map(|y| -0.5 * y.norm_squared() - self.log_root).collect()
    }
}

impl Outlook {
    /// As things stand.
    pub(super) fn now(weights: &[f64]) -> Self {
        let best = weights.iter().copied().fold(0.0, f64::max);
        Outlook { truth: weights.iter().map(|w| w * w).sum(), resolved: if best >= RESOLVED { best } else { 0.0 } }
    }

    /// After the measurements of these columns (of a pool, three each).
    ///
    /// Data are drawn as each rival predicts them, its own uncertainty included, and judged by Bayes' rule as a diagnosis would:
    /// `P(b | y) ~ pi_b N(y; X_b theta_b, I + X_b P_b X_b^T)`. Averaging over the draws takes in that a measurement may also mislead.
    pub(super) fn after(states: &[State], weights: &[f64], columns: &DMatrix<f64>, seed: u64) -> Result<Self, FitError> {
        let size = columns.ncols();
        let side = |state: &State| -> Result<Forecast, FitError> {
            let x = columns.select_rows(&state.rows);
            let spread = DMatrix::identity(size, size) + x.tr_mul(&(&state.covariance * &x));
            let factor = Cholesky::new(spread).ok_or(FitError::Singular)?;
            let log_root = factor.l_dirty().diagonal().iter().map(|l| l.ln()).sum();
            Ok(Forecast { mean: x.tr_mul(&state.mean), factor, log_root })
        };
        let sides = states.iter().map(side).collect::<Result<Vec<_>, _>>()?;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normal = DMatrix::<f64>::from_fn(size, DRAWS, |_, _| StandardNormal.sample(&mut random));
        let of_truth = |a: usize| {
            let mut data = sides[a].factor.l() * &normal;
            data.column_iter_mut().for_each(|mut y| y += &sides[a].mean);
            let all: Vec<Vec<f64>> = sides.iter().map(|side| side.log_likelihoods(&data)).collect();
            let mut outlook = Outlook { truth: 0.0, resolved: 0.0 };
            for draw in 0..DRAWS {
                let log: Vec<f64> = all.iter().zip(weights).map(|(l, w)| l[draw] + w.ln()).collect();
                let largest = first_largest(&log).map_or(0.0, |k| log[k]);
                let own = (log[a] - largest).exp() / log.iter().map(|l| (l - largest).exp()).sum::<f64>();
                outlook.truth += own / DRAWS as f64;
                outlook.resolved += if own >= RESOLVED { 1.0 / DRAWS as f64 } else { 0.0 };
            }
            outlook
        };
        let each: Vec<Outlook> = (0..states.len()).into_par_iter().map(of_truth).collect();
        let mean = |of: fn(&Outlook) -> f64| each.iter().zip(weights).map(|(o, w)| w * of(o)).sum();
        Ok(Outlook { truth: mean(|o| o.truth), resolved: mean(|o| o.resolved) })
    }
}

/// How wrong the robot will still be over the workspace when the whole library is fitted to the data, and what lowers that most
/// (I-optimality: least `tr(V P V^T)`).
///
/// Kept in the space of measurements, as a Gaussian field is: covariances of the candidates among themselves, with the errors over the
/// workspace, and of those at each pose.
pub(super) struct WorkspaceOutlook {
    /// Candidates with themselves, 3N x 3N.
    own: DMatrix<f64>,
    /// Candidates with the errors over the workspace, 3N x 3W.
    with_errors: DMatrix<f64>,
    /// Error at each pose, m².
    errors: Vec<Matrix3<f64>>,
}

impl WorkspaceOutlook {
    /// Of a pool's columns and the fields over the workspace, both times a root of the covariance: candidates x numbers, errors x numbers.
    pub fn new(candidates: &DMatrix<f64>, errors: &DMatrix<f64>) -> Self {
        let mut own = DMatrix::zeros(candidates.nrows(), candidates.nrows());
        linalg::normal_matrix(candidates, &mut own);
        let block = |p: usize| {
            let rows = errors.rows(3 * p, 3);
            Matrix3::from_fn(|r, c| rows.row(r).dot(&rows.row(c)))
        };
        WorkspaceOutlook {
            own,
            with_errors: linalg::product_with_transposed(candidates, errors),
            errors: (0..errors.nrows() / 3).map(block).collect(),
        }
    }

    fn precision(&self, candidate: usize) -> Matrix3<f64> {
        let spread = Matrix3::identity() + self.own.fixed_view::<3, 3>(3 * candidate, 3 * candidate);
        spread.cholesky().map_or_else(Matrix3::zeros, |c| c.inverse())
    }

    /// By how much a candidate lowers the sum of squares over the workspace.
    fn gain(&self, candidate: usize) -> f64 {
        let with = self.with_errors.rows(3 * candidate, 3);
        (self.precision(candidate) * with).iter().zip(with.iter()).map(|(a, b)| a * b).sum()
    }

    /// Takes the candidate that lowers it most among those not taken; `None` when all are.
    pub fn choose(&mut self, taken: &[usize]) -> Option<usize> {
        let free: Vec<usize> = (0..self.own.nrows() / 3).filter(|i| !taken.contains(i)).collect();
        let gains: Vec<f64> = free.par_iter().map(|&i| self.gain(i)).collect();
        let best = free[first_largest(&gains)?];
        self.take(best);
        Some(best)
    }

    /// Learns from a candidate.
    pub fn take(&mut self, candidate: usize) {
        let precision = self.precision(candidate);
        let with_own = self.own.columns(3 * candidate, 3).into_owned();
        let with_errors = self.with_errors.rows(3 * candidate, 3).into_owned();
        let weighted = &with_own * precision;
        self.own.gemm(-1.0, &weighted, &with_own.transpose(), 1.0);
        self.with_errors.gemm(-1.0, &weighted, &with_errors, 1.0);
        for (p, error) in self.errors.iter_mut().enumerate() {
            let with = with_errors.fixed_view::<3, 3>(0, 3 * p);
            *error -= with.transpose() * precision * with;
        }
    }

    /// Expected length of the error, mean over the workspace, m.
    pub fn mean(&self) -> f64 {
        self.errors.iter().map(expected_length).sum::<f64>() / self.errors.len().max(1) as f64
    }
}

/// Expected length of a normal vector of mean zero: `1/(2 sqrt(pi)) integral (1 - det(1 + 2 t S)^(-1/2)) t^(-3/2) dt`, from
/// `sqrt(x) = 1/(2 sqrt(pi)) integral (1 - exp(-x t)) t^(-3/2) dt`.
fn expected_length(covariance: &Matrix3<f64>) -> f64 {
    let scale = covariance.trace();
    if scale <= 0.0 {
        return 0.0;
    }
    let unit = covariance / scale;
    // Second invariant, sum of the principal minors; the first is 1. det(I + 2 t S) - 1 must not be lost to rounding at small t.
    let minor = |a: usize, b: usize| unit[(a, a)] * unit[(b, b)] - unit[(a, b)] * unit[(b, a)];
    let second = (minor(0, 1) + minor(1, 2) + minor(0, 2)).max(0.0);
    let third = unit.determinant().max(0.0);
    // Trapezoid in u = ln t; the integrand falls off as exp(-|u|/2), so that 1e-10 is left beyond the ends.
    const STEP: f64 = 0.25;
    let at = |k: i32| {
        let u = STEP * f64::from(k);
        let x = 2.0 * u.exp();
        let grown = x + x * x * second + x * x * x * third;
        -(-0.5 * grown.ln_1p()).exp_m1() * (-0.5 * u).exp()
    };
    let sum: f64 = (-180..=180).map(at).sum();
    scale.sqrt() * sum * STEP / (2.0 * std::f64::consts::PI.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_normal_vectors() {
        let one = Matrix3::from_diagonal(&[1.0, 0.0, 0.0].into());
        let three = Matrix3::identity() * 4.0;
        let pi = std::f64::consts::PI;
        assert!((expected_length(&one) - (2.0 / pi).sqrt()).abs() < 1e-8);
        assert!((expected_length(&three) - 2.0 * (8.0 / pi).sqrt()).abs() < 1e-8);
    }

    fn state(row: usize, mean: f64) -> State {
        State { rows: vec![row], mean: DVector::from_element(1, mean), covariance: DMatrix::zeros(1, 1) }
    }

    /// Two equally likely rivals whose predictions of one datum are apart by d: resolved is `Phi(d/2 - ln 19 / d)`, the chance that the
    /// logarithm of the odds, normal with mean d²/2 and variance d², exceeds ln 19.
    #[test]
    fn the_chance_to_resolve_two_by_hand() {
        let mut columns = DMatrix::zeros(2, 3);
        columns[(0, 0)] = 1.0;
        let outlook = Outlook::after(&[state(0, 4.0), state(1, 0.0)], &[0.5, 0.5], &columns, 1).unwrap();
        // Phi(2 - 0.7361) = 0.8968
        assert!((outlook.resolved - 0.8968).abs() < 0.03, "{}", outlook.resolved);
        let nothing = Outlook::after(&[state(0, 0.0), state(1, 0.0)], &[0.7, 0.3], &columns, 1).unwrap();
        assert!((nothing.truth - 0.58).abs() < 1e-12 && nothing.resolved == 0.0);
        assert_eq!(Outlook::now(&[0.7, 0.3]).resolved, 0.0);
    }

    /// One number of variance 4 that moves candidate and workspace alike: measured with variance 1, 0.8 is left.
    #[test]
    fn what_is_measured_is_no_longer_wrong() {
        let mut candidates = DMatrix::zeros(6, 2);
        (candidates[(0, 0)], candidates[(4, 1)]) = (2.0, 1.0);
        let mut errors = DMatrix::zeros(3, 2);
        errors[(1, 0)] = 2.0;
        let mut outlook = WorkspaceOutlook::new(&candidates, &errors);
        assert!((outlook.mean() - 2.0 * (2.0 / std::f64::consts::PI).sqrt()).abs() < 1e-7);
        assert_eq!(outlook.choose(&[]), Some(0));
        assert!((outlook.errors[0][(1, 1)] - 0.8).abs() < 1e-14);
        assert_eq!(outlook.choose(&[0]), Some(1));
        assert!((outlook.errors[0][(1, 1)] - 0.8).abs() < 1e-14);
    }
}
