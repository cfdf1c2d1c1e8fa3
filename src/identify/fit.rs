//! Least squares: Gauss-Newton with column scaling, damped (Levenberg-Marquardt) only when a step fails.
//!
//! Minimises `|W (y - f(rho))|² + sum over stated parameters ((rho - rho_0) / sigma)²`. Columns that the data cannot tell from
//! earlier ones are found first and left at their drawing values.

use nalgebra::{DMatrix, DVector};
use thiserror::Error;

use super::linalg::{self, Cholesky, LinalgError, OrderedRank};
use super::{Knowledge, Observability, Parameter, Problem};

/// A column whose part outside the span of earlier columns is shorter than this fraction of it is taken as dependent: far above
/// rounding (1e-13 after column scaling), far below what any measurement could resolve.
const RANK_TOLERANCE: f64 = 1e-6;

/// The fit has converged when the predicted change of the whitened residual vector is shorter than this.
const STEP_TOLERANCE: f64 = 1e-8;

const MAX_ITERATIONS: usize = 60;

/// The posture has settled when no parameter moves by more than this share of its uncertainty.
const SETTLED: f64 = 1e-3;

/// Each weighing shrinks the change by the ratio of deflection to arm length, about 1e-2: three are enough.
const MOST_WEIGHINGS: usize = 5;

/// Why the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The last step was negligible.
    Converged,
    /// No step lowers the cost any more: the minimum within rounding.
    NoFurtherDescent,
    /// The allowed number of iterations was used.
    IterationLimit,
}

/// Why there is no fit.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum FitError {
    /// No residual is left over to judge the unknowns by.
    #[error("{rows} residuals are too few for {unknowns} unknowns; measure more poses or use a smaller model")]
    TooFewRows {
        /// Scalar residuals.
        rows: usize,
        /// Unknowns.
        unknowns: usize,
    },
    /// Residual or Jacobian is not a number.
    #[error("the residuals are not finite at the start of the fit; check joint angles and positions for absurd values")]
    NotFinite,
    /// The normal matrix could not be factored.
    #[error("the normal equations are singular although the columns are independent; the data are too badly scaled")]
    Singular,
    /// A decomposition failed.
    #[error(transparent)]
    Linalg(#[from] LinalgError),
}

/// Parameters that the data cannot tell apart: the one left at its drawing value, then those that can take its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Unresolved {
    /// The parameter that was left out.
    pub parameter: usize,
    /// Parameters that move the same way, strongest first; empty when nothing measured moves at all.
    pub with: Vec<usize>,
}

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Deviation of every parameter from where the fit starts, SI; zero for those left out.
    pub values: Vec<f64>,
    /// Parameters that were estimated, ascending.
    pub kept: Vec<usize>,
    /// Covariance of the kept parameters, SI (kept x kept).
    pub covariance: DMatrix<f64>,
    /// What could not be told apart.
    pub unresolved: Vec<Unresolved>,
    /// Root mean square of the 3-D residual over samples, m.
    pub rms: f64,
    /// Whitened sum of squares, stated parameters included.
    pub chi2: f64,
    /// Residuals minus flat unknowns.
    pub dof: usize,
    /// Whether `covariance` rests on stated noise; if not it is scaled by chi2/dof.
    pub noise_stated: bool,
    /// Gauss-Newton steps taken.
    pub iterations: usize,
    /// Why it ended.
    pub stop: Stop,
    /// Observability indices of the flat parameters at the solution, in SI.
    pub observability: Observability,
    /// Condition number of their column-scaled Jacobian.
    pub condition: f64,
}

impl Fit {
    /// One-sigma of a parameter, SI; `None` when it was left out.
    pub fn sigma(&self, parameter: usize) -> Option<f64> {
        let k = self.kept.binary_search(&parameter).ok()?;
        Some(self.covariance[(k, k)].max(0.0).sqrt())
    }

    /// Largest difference of a kept parameter from `values`, in its sigmas.
    fn steps_from(&self, values: &[f64]) -> f64 {
        let step = |k: usize, p: usize| (self.values[p] - values[p]).abs() / self.covariance[(k, k)].sqrt();
        self.kept.iter().enumerate().map(|(k, &p)| step(k, p)).fold(0.0, f64::max)
    }

    /// Number of flat parameters estimated.
    pub fn rank(&self, parameters: &[Parameter]) -> usize {
        self.kept.iter().filter(|&&p| parameters[p].knowledge == Knowledge::Flat).count()
    }
}

/// Fits all unknowns of the problem from its start.
///
/// # Errors
/// When there are fewer residuals than unknowns or the numbers are not finite.
pub fn fit(problem: &mut Problem) -> Result<Fit, FitError> {
    let all: Vec<usize> = (0..problem.parameters().len()).collect();
    let start = problem.start();
    fit_some(problem, &start, &all)
}

/// Fits the parameters listed in `free` (ascending) and leaves the others at `start` (deviations, SI).
///
/// # Errors
/// As [`fit`].
pub fn fit_some(problem: &mut Problem, start: &[f64], free: &[usize]) -> Result<Fit, FitError> {
    let (kept, unresolved) = determined(problem, start, free)?;
    let mut fit = Solver::new(problem, &kept)?.run(start.to_vec())?;
    for _ in 0..MOST_WEIGHINGS {
        if !problem.reweigh(&fit.values) {
            break;
        }
        let before = fit;
        fit = Solver::new(problem, &kept)?.run(before.values.clone())?;
        fit.iterations += before.iterations;
        if fit.steps_from(&before.values) < SETTLED {
            break;
        }
    }
    fit.unresolved = unresolved;
    Ok(fit)
}

/// The parameters to estimate (ascending): the flat ones that the data tell apart, and those stated; and what is left out.
fn determined(problem: &Problem, start: &[f64], free: &[usize]) -> Result<(Vec<usize>, Vec<Unresolved>), FitError> {
    let Rank { mut kept, unresolved } = ordered_rank(problem, start, free)?;
    let flat = kept.len();
    kept.extend(free.iter().filter(|&&p| problem.parameters()[p].knowledge != Knowledge::Flat));
    kept.sort_unstable();
    // As many independent columns as rows: further unknowns were left out for want of rows, and nothing tells how good the others are.
    if problem.row_count() <= flat {
        return Err(FitError::TooFewRows { rows: problem.row_count(), unknowns: flat + unresolved.len() });
    }
    Ok((kept, unresolved))
}

/// The flat parameters that the problem's samples can tell apart at its start, ascending.
///
/// # Errors
/// When the numbers are not finite.
pub fn independent_parameters(problem: &Problem) -> Result<Vec<usize>, FitError> {
    let all: Vec<usize> = (0..problem.parameters().len()).collect();
    Ok(ordered_rank(problem, &problem.start(), &all)?.kept)
}

/// Observability indices of a Jacobian (3 x poses rows, SI).
///
/// # Errors
/// When it cannot be decomposed.
pub fn observability_of(jacobian: &DMatrix<f64>, poses: usize) -> Result<Observability, FitError> {
    Ok(Observability::new(&linalg::singular_values(jacobian)?, poses))
}

struct Solver<'a> {
    problem: &'a Problem,
    kept: Vec<usize>,
    /// 1/sigma² of the kept parameters; zero when flat.
    information: DVector<f64>,
}

impl<'a> Solver<'a> {
    fn new(problem: &'a Problem, kept: &[usize]) -> Result<Self, FitError> {
        let information = kept.iter().map(|&p| match problem.parameters()[p].knowledge {
            Knowledge::Flat => 0.0,
            Knowledge::Stated(sigma) => 1.0 / (sigma * sigma),
        });
        Ok(Solver { problem, kept: kept.to_vec(), information: DVector::from_iterator(kept.len(), information) })
    }

    fn run(self, mut values: Vec<f64>) -> Result<Fit, FitError> {
        let problem = self.problem;
        let (rows, unknowns) = (problem.row_count(), self.kept.len());
        let mut work = problem.workspace();
        let mut trial = values.clone();
        let mut r = DVector::zeros(rows);
        let mut full = DMatrix::zeros(rows, problem.parameters().len());
        let mut j = DMatrix::zeros(rows, unknowns);
        let mut normal = DMatrix::zeros(unknowns, unknowns);
        let mut damped = normal.clone();
        let mut factor = Cholesky::new(unknowns);
        let (mut gradient, mut scale, mut step) =
            (DVector::zeros(unknowns), DVector::zeros(unknowns), DVector::zeros(unknowns));
        let (mut lambda, mut iterations, mut stop) = (0.0, 0, Stop::IterationLimit);
        problem.evaluate(&values, &mut work, &mut r, Some(&mut full));
        let mut cost = r.norm_squared() + self.penalty(&values);
        if !cost.is_finite() {
            return Err(FitError::NotFinite);
        }
        let mut fresh = true;
        while iterations < MAX_ITERATIONS {
            if fresh {
                for (k, &p) in self.kept.iter().enumerate() {
                    j.column_mut(k).copy_from(&full.column(p));
                }
                linalg::normal_matrix(&j, &mut normal);
                j.tr_mul_to(&r, &mut gradient);
                for (k, &p) in self.kept.iter().enumerate() {
                    normal[(k, k)] += self.information[k];
                    gradient[k] -= self.information[k] * values[p];
                    scale[k] = 1.0 / normal[(k, k)].sqrt();
                }
            }
            for c in 0..unknowns {
                for row in 0..unknowns {
                    damped[(row, c)] = normal[(row, c)] * scale[row] * scale[c];
                }
                damped[(c, c)] += lambda;
                step[c] = gradient[c] * scale[c];
            }
            if factor.factor(&damped).is_err() {
                if lambda > 1e6 {
                    return Err(FitError::Singular);
                }
                lambda = f64::max(10.0 * lambda, 1e-10);
                fresh = false;
                continue;
            }
            factor.solve_in_place(step.as_mut_slice());
            let length = step.norm();
            trial.copy_from_slice(&values);
            for (k, &p) in self.kept.iter().enumerate() {
                trial[p] += step[k] * scale[k];
            }
            problem.evaluate(&trial, &mut work, &mut r, Some(&mut full));
            let new_cost = r.norm_squared() + self.penalty(&trial);
            iterations += 1;
            // Within rounding of the sum of squares a step of the last digits may go either way.
            if new_cost.is_finite() && new_cost <= cost * (1.0 + 1e-12) + 1e-18 {
                std::mem::swap(&mut values, &mut trial);
                cost = new_cost;
                lambda = if lambda < 1e-8 { 0.0 } else { lambda / 10.0 };
                fresh = true;
                if length < STEP_TOLERANCE {
                    stop = Stop::Converged;
                    break;
                }
            } else {
                problem.evaluate(&values, &mut work, &mut r, Some(&mut full));
                if length < 1e-5 || lambda > 1e8 {
                    stop = Stop::NoFurtherDescent;
                    break;
                }
                lambda = f64::max(10.0 * lambda, 1e-6);
                fresh = false;
            }
        }
        self.finish(values, cost, &full, iterations, stop)
    }

    fn penalty(&self, values: &[f64]) -> f64 {
        self.kept.iter().zip(self.information.iter()).map(|(&p, &w)| w * values[p] * values[p]).sum()
    }

    fn finish(self, values: Vec<f64>, chi2: f64, full: &DMatrix<f64>, iterations: usize, stop: Stop) -> Result<Fit, FitError> {
        let problem = self.problem;
        let parameters = problem.parameters();
        let flat: Vec<usize> = self.kept.iter().copied().filter(|&p| parameters[p].knowledge == Knowledge::Flat).collect();
        let dof = problem.row_count() - flat.len();
        let j = full.select_columns(&self.kept);
        let mut normal = DMatrix::zeros(self.kept.len(), self.kept.len());
        linalg::normal_matrix(&j, &mut normal);
        for k in 0..self.kept.len() {
            normal[(k, k)] += self.information[k];
        }
        let scale: Vec<f64> = (0..normal.nrows()).map(|k| 1.0 / normal[(k, k)].sqrt()).collect();
        let scaled = DMatrix::from_fn(normal.nrows(), normal.ncols(), |r, c| normal[(r, c)] * scale[r] * scale[c]);
        let mut factor = Cholesky::new(normal.nrows());
        factor.factor(&scaled)?;
        let mut covariance = normal;
        factor.inverse(&mut covariance);
        covariance = DMatrix::from_fn(scale.len(), scale.len(), |r, c| covariance[(r, c)] * scale[r] * scale[c]);
        if !problem.noise_stated() && dof > 0 {
            covariance *= chi2 / dof as f64;
        }
        let residuals = problem.residuals(&values);
        let rms = (residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / residuals.len() as f64).sqrt();
        let mut plain = problem.plain_jacobian(&values, &flat);
        let observability = observability_of(&plain, problem.sample_count())?;
        for mut column in plain.column_iter_mut() {
            let norm = column.norm();
            column /= norm;
        }
        let condition = observability_of(&plain, problem.sample_count())?.condition();
        Ok(Fit {
            values,
            kept: self.kept,
            covariance,
            unresolved: Vec::new(),
            rms,
            chi2,
            dof,
            noise_stated: problem.noise_stated(),
            iterations,
            stop,
            observability,
            condition,
        })
    }
}

struct Rank {
    kept: Vec<usize>,
    unresolved: Vec<Unresolved>,
}

/// Which flat parameters the data can tell apart, preferring earlier effects, and among links those nearer to the tool: the
/// base takes what it shares with link 1, and of two parallel axes the farther one keeps its offset, as in the paper.
fn ordered_rank(problem: &Problem, start: &[f64], free: &[usize]) -> Result<Rank, FitError> {
    let parameters = problem.parameters();
    let mut work = problem.workspace();
    let mut r = DVector::zeros(problem.row_count());
    let mut full = DMatrix::zeros(problem.row_count(), parameters.len());
    problem.evaluate(start, &mut work, &mut r, Some(&mut full));
    if !r.iter().chain(full.iter()).all(|v| v.is_finite()) {
        return Err(FitError::NotFinite);
    }
    let mut order: Vec<usize> = free.iter().copied().filter(|&p| parameters[p].knowledge == Knowledge::Flat).collect();
    let mut effects: Vec<&str> = Vec::new();
    for p in parameters {
        if !effects.contains(&p.effect.as_str()) {
            effects.push(&p.effect);
        }
    }
    let rank_of_effect = |p: &usize| effects.iter().position(|e| *e == parameters[*p].effect);
    order.sort_by_key(|p| (rank_of_effect(p), std::cmp::Reverse(parameters[*p].link)));
    let OrderedRank { kept, dependent } = linalg::ordered_independent_columns(&full.select_columns(&order), RANK_TOLERANCE);
    let mut kept: Vec<usize> = kept.into_iter().map(|k| order[k]).collect();
    kept.sort_unstable();
    let mut unresolved: Vec<Unresolved> = dependent
        .into_iter()
        .map(|d| {
            let mut with = d.combination;
            with.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            Unresolved { parameter: order[d.column], with: with.into_iter().map(|(k, _)| order[k]).collect() }
        })
        .collect();
    unresolved.sort_by_key(|u| u.parameter);
    Ok(Rank { kept, unresolved })
}
