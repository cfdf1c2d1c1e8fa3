//! Uncertainty of the parameters due to noise and model discrepancy.
//!
//! Two estimates from the residuals, neither of which may make a parameter more certain than the noise does: postures as
//! clusters, each left out in turn (the sandwich with leverages, CR3; Bell & McCaffrey 2002), and errors of every joint's
//! angle, periodic in that angle, with a size estimated from the residuals, fitted together with the parameters. The second
//! accounts for the correlation of parameters and errors.

use nalgebra::{DMatrix, DVector};

use super::fit_result::{Fit, FitError};
use super::problem::SampleContext;
use super::problem::{Prior, Problem};
use crate::math::linalg;
use crate::math::positive_definite::{ScaledCholesky, cholesky};
use crate::measure::poses::Postures;
use crate::units::URAD;

/// Orders per revolution of a joint's error.
const ORDERS: usize = 4;

/// Ordinary size of a joint's error, rad.
const ORDINARY: f64 = 50.0 * URAD;

/// Initial variance of a joint's error, in squares of the ordinary size.
const BEGIN: f64 = 1.0;
/// Upper limit of the variance of a joint's error, in squares of the ordinary size.
const MOST: f64 = 1e4;

/// Number of iterations in which the variances are estimated.
const ROUNDS: usize = 12;

/// If the noise is stated, residuals within this many standard deviations of it indicate no model discrepancy.
const NOISE_ALONE: f64 = 3.0;

/// Second moments of the errors of the kept parameters (kept x kept), SI: `fit.covariance` if noise explains the residuals.
///
/// # Errors
/// When a decomposition fails.
pub(crate) fn covariance_with_model_error(problem: &Problem, fit: &Fit) -> Result<DMatrix<f64>, FitError> {
    let dof = fit.dof as f64;
    if fit.kept.is_empty() || dof < 1.0 || fit.noise_stated && fit.chi2 < dof + NOISE_ALONE * (2.0 * dof).sqrt() {
        return Ok(fit.covariance.clone());
    }
    let contexts = problem.contexts(&fit.values);
    let near = problem.whitened(&fit.values, &fit.kept);
    let information: Vec<f64> = fit.kept.iter().map(|&p| problem.information(p)).collect();
    let by_errors = joint_errors(problem, fit, &near, &contexts, &information)?;
    let by_postures = left_out_in_turn(&near, &contexts, &information)?;
    Ok(widest(&fit.covariance, [by_errors, by_postures]))
}

/// Widens the larger of the two others, parameter by parameter, to the largest variance of all three; its correlations are
/// kept.
fn widest(noise: &DMatrix<f64>, others: [DMatrix<f64>; 2]) -> DMatrix<f64> {
    let size = |c: &DMatrix<f64>| (0..c.nrows()).map(|k| c[(k, k)] / noise[(k, k)]).sum::<f64>();
    let [a, b] = others;
    let (mut wide, other) = if size(&b) > size(&a) { (b, a) } else { (a, b) };
    let grow: Vec<f64> = (0..wide.nrows())
        .map(|k| (noise[(k, k)].max(other[(k, k)]) / wide[(k, k)]).max(1.0).sqrt())
        .map(|g| if g.is_finite() { g } else { 1.0 })
        .collect();
    for r in 0..wide.nrows() {
        for c in 0..wide.ncols() {
            wide[(r, c)] *= grow[r] * grow[c];
        }
    }
    wide
}

/// Number of error columns of a joint.
const PER_JOINT: usize = 2 * ORDERS;

/// Fits errors of every joint's angle together with the parameters. `r^T`, the last row of the linearised problem, holds
/// the residuals; the other rows are columns. Returns the second moments: the parameters' covariance plus the square of their
/// shift.
fn joint_errors(
    problem: &Problem,
    fit: &Fit,
    near: &DMatrix<f64>,
    contexts: &[SampleContext],
    information: &[f64],
) -> Result<DMatrix<f64>, FitError> {
    let (m, joints) = (fit.kept.len(), problem.robot().joints());
    let rows = near.ncols();
    let gram = gram_with_joint_errors(near, joints, contexts);
    let n = m + joints * PER_JOINT;
    let flat = fit.kept.iter().filter(|&&p| problem.parameters()[p].knowledge == Prior::Uninformative).count() as f64;
    let left = gram[(n, n)];
    let least = if fit.noise_stated { 1.0 } else { 0.0 };
    let mut noise: f64 = (left / (rows as f64 - flat).max(1.0)).max(least);
    let mut variances = vec![BEGIN; joints];
    let (mut inverter, mut found) = (Inverter::new(n), DVector::zeros(n));
    for round in 0..ROUNDS {
        let prior = |k: usize| if k < m { information[k] } else { 1.0 / variances[(k - m) / PER_JOINT] };
        inverter.invert(&gram, noise, prior)?;
        let inverse = &inverter.inverse;
        // A parameter with a prior is pulled towards zero from its present value.
        let pull = |k: usize| if k < m { information[k] * fit.values[fit.kept[k]] } else { 0.0 };
        let right = DVector::from_fn(n, |k, _| gram[(k, n)] / noise - pull(k));
        found = inverse * right;
        if round + 1 == ROUNDS {
            break;
        }
        let mut effective = flat;
        for (j, v) in variances.iter_mut().enumerate() {
            let own = m + j * PER_JOINT..m + (j + 1) * PER_JOINT;
            let spread: f64 = own.clone().map(|k| inverse[(k, k)]).sum();
            effective += PER_JOINT as f64 - spread / *v;
            *v = ((own.map(|k| found[k] * found[k]).sum::<f64>() + spread) / PER_JOINT as f64).clamp(1e-6, MOST);
        }
        let squares = left - 2.0 * (0..n).map(|k| found[k] * gram[(k, n)]).sum::<f64>()
            + (0..n).map(|r| found[r] * (0..n).map(|c| gram[(r, c)] * found[c]).sum::<f64>()).sum::<f64>();
        noise = (squares / (rows as f64 - effective).max(1.0)).max(least);
    }
    let moved = found.rows(0, m);
    Ok(inverter.inverse.view((0, 0), (m, m)) + moved * moved.transpose())
}

/// Products of the parameters' columns, the joints' error columns of ordinary size, and the residuals, in this order.
fn gram_with_joint_errors(near: &DMatrix<f64>, joints: usize, contexts: &[SampleContext]) -> DMatrix<f64> {
    let m = near.nrows() - 1;
    let errors = joints * PER_JOINT;
    let mut all = DMatrix::zeros(m + errors + 1, near.ncols());
    all.rows_mut(0, m).copy_from(&near.rows(0, m));
    all.row_mut(m + errors).copy_from(&near.row(m));
    let unit = ORDINARY / (ORDERS as f64).sqrt();
    for at in contexts {
        for (j, column) in at.joints.iter().enumerate() {
            for h in 1..=ORDERS {
                let (sin, cos) = (h as f64 * at.q[j]).sin_cos();
                let first = m + j * PER_JOINT + 2 * (h - 1);
                for k in 0..at.height {
                    all[(first, at.first_row + k)] = column[k] * unit * sin;
                    all[(first + 1, at.first_row + k)] = column[k] * unit * cos;
                }
            }
        }
    }
    let mut gram = DMatrix::zeros(m + errors + 1, m + errors + 1);
    linalg::normal_matrix(&all, &mut gram);
    gram
}

/// Inverts normal matrices of one size, scaled to a unit diagonal meanwhile.
struct Inverter {
    factor: ScaledCholesky,
    inverse: DMatrix<f64>,
}

impl Inverter {
    fn new(n: usize) -> Self {
        Inverter { factor: ScaledCholesky::new(n), inverse: DMatrix::zeros(n, n) }
    }

    /// Sets `inverse` to that of `gram / noise` plus the diagonal `prior`; the rows of `gram` beyond its size are not used.
    fn invert(&mut self, gram: &DMatrix<f64>, noise: f64, prior: impl Fn(usize) -> f64) -> Result<(), FitError> {
        let scale = |k: usize| 1.0 / (gram[(k, k)] / noise + prior(k)).sqrt();
        self.factor.factor(scale, |r, c| gram[(r, c)] / noise, |c, scale| prior(c) * scale * scale)?;
        self.inverse = self.factor.inverse();
        Ok(())
    }
}

/// The sandwich with leverages: sum of the parameter changes as each posture is left out in turn.
fn left_out_in_turn(near: &DMatrix<f64>, contexts: &[SampleContext], information: &[f64]) -> Result<DMatrix<f64>, FitError> {
    let m = information.len();
    let mut gram = DMatrix::zeros(m + 1, m + 1);
    linalg::normal_matrix(near, &mut gram);
    let mut normal = gram.view((0, 0), (m, m)).into_owned();
    (0..m).for_each(|k| normal[(k, k)] += information[k]);
    let mut factor = ScaledCholesky::of(&normal)?;
    let inverse = factor.inverse_of_scaled();
    let scale = factor.scale();
    let mut sum = DMatrix::zeros(m, m);
    let joints: Vec<&[f64]> = contexts.iter().map(|c| c.q.as_slice()).collect();
    let setups: Vec<usize> = contexts.iter().map(|c| c.setup).collect();
    for group in Postures::of_joints(&joints, &setups).members() {
        let rows: Vec<usize> =
            group.iter().flat_map(|&k| contexts[k].first_row..contexts[k].first_row + contexts[k].height).collect();
        let columns = DMatrix::from_fn(m, rows.len(), |p, k| near[(p, rows[k])] * scale[p]);
        let left = DVector::from_fn(rows.len(), |k, _| near[(m, rows[k])]);
        let moves = linalg::product(&inverse, &columns);
        // A posture that alone determines some parameter has no independent residual there.
        let mut remaining = -linalg::product_of_transposed(&columns, &moves);
        (0..rows.len()).for_each(|k| remaining[(k, k)] += 1.0 + LEAST_LEFT);
        let moved = &moves * cholesky(remaining)?.solve(&left);
        sum.ger(1.0, &moved, &moved, 1.0);
    }
    Ok(DMatrix::from_fn(m, m, |r, c| sum[(r, c)] * scale[r] * scale[c]))
}

/// Lower limit of the share of a residual that is independent.
const LEAST_LEFT: f64 = 1e-3;
