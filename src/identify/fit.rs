//! Least squares: Gauss-Newton with column scaling, damped (Levenberg-Marquardt) only when a step fails.
//!
//! Minimises `|W (y - f(rho))|² + sum over stated parameters ((rho - rho_0) / sigma)²`. Columns that the data cannot tell from
//! earlier ones are found first and left at their drawing values; so are those of the arm that the data see so faintly that their
//! estimates would be far beyond anything plausible.

use nalgebra::{DMatrix, DVector};
use thiserror::Error;

use super::linalg::{self, Cholesky, LinalgError, OrderedRank};
use super::{Knowledge, Observability, Parameter, Problem};
use crate::effects::Owner;

/// A column whose part outside the span of earlier columns is shorter than this fraction of it is taken as dependent: far above
/// rounding (1e-13 after column scaling), far below what any measurement could resolve.
const RANK_TOLERANCE: f64 = 1e-6;

/// A parameter of the arm is left at its drawing value when its plausible size (one sigma of [`ParameterSpec::prior`]) would move the
/// whitened residuals by less than this, all others free to follow: its estimate would be uncertain by more than three plausible
/// sizes. It would tell nothing, drag others far from the drawing with it (wrist offsets by centimetres, where the TCP is within half
/// a millimetre of the last axis), and do harm elsewhere, where its column is no longer what the others can make up. What the drawing
/// leaves open (bases, free tools and balls) has no plausible size and is judged by [`RANK_TOLERANCE`] alone. Where the noise is not
/// stated, the residuals stand in for it.
///
/// [`ParameterSpec::prior`]: crate::effects::ParameterSpec::prior
const FAINT: f64 = 0.3;

/// The same for the base and the link on it, where both are sought. Of a robot on a wall, Ry near 90 deg, Rz and Rx turn about one axis;
/// apart by less than a third of a degree they would run away against each other, while the first joint's offset does what they cannot.
const LOCKED: f64 = 5e-3;

/// Columns are judged anew after a fit that moved a tool or a ball by more plausible sizes than this: they are not what they were.
const FAR: f64 = 100.0;

/// How often the columns are judged; on measured data the third time has agreed with the second.
const MOST_JUDGEMENTS: usize = 4;

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
    let (mut kept, mut unresolved) = determined(problem, start, free, problem.noise_at(start))?;
    let mut fit = settle(problem, start.to_vec(), &kept)?;
    for _ in 1..MOST_JUDGEMENTS {
        let set_up = |p: usize| problem.parameters()[p].owner != Owner::Robot;
        // Not the base: where the robot stands changes nothing within the arm.
        let guessed = |p: usize| set_up(p) && problem.parameters()[p].effect != "base_frame";
        let far = |&p: &usize| guessed(p) && (fit.values[p] - start[p]).abs() > FAR * problem.parameters()[p].spec.prior;
        if problem.noise_stated() && !kept.iter().any(far) {
            break;
        }
        // The arm as drawn, set up as found: links that the fit has turned a little would tell apart what no drawing does.
        let mut at = start.to_vec();
        kept.iter().filter(|&&p| set_up(p)).for_each(|&p| at[p] = fit.values[p]);
        let (kept_now, unresolved_now) = determined(problem, &at, free, problem.noise_at(&fit.values))?;
        if kept_now == kept {
            break;
        }
        (kept, unresolved) = (kept_now, unresolved_now);
        let before = fit.iterations;
        fit = settle(problem, at, &kept)?;
        fit.iterations += before;
    }
    fit.unresolved = unresolved;
    Ok(fit)
}

/// Fits those parameters, and weighs the arm in the posture found, until it rests.
fn settle(problem: &mut Problem, start: Vec<f64>, kept: &[usize]) -> Result<Fit, FitError> {
    let mut fit = Solver::new(problem, kept)?.run(start)?;
    for _ in 0..MOST_WEIGHINGS {
        if !problem.reweigh(&fit.values) {
            break;
        }
        let before = fit;
        fit = Solver::new(problem, kept)?.run(before.values.clone())?;
        fit.iterations += before.iterations;
        if fit.steps_from(&before.values) < SETTLED {
            break;
        }
    }
    Ok(fit)
}

/// The parameters to estimate (ascending): the flat ones that the data tell apart, and those stated; and what is left out.
fn determined(problem: &Problem, start: &[f64], free: &[usize], noise: f64) -> Result<(Vec<usize>, Vec<Unresolved>), FitError> {
    let Rank { mut kept, unresolved } = ordered_rank(problem, start, free, noise)?;
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
    let start = problem.start();
    Ok(ordered_rank(problem, &start, &all, problem.noise_at(&start))?.kept)
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
            // |J step|, but for the damping: what the step does to the whitened residuals, however ill-determined the unknowns.
            let length = (0..unknowns).map(|c| step[c] * gradient[c] * scale[c]).sum::<f64>().max(0.0).sqrt();
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
fn ordered_rank(problem: &Problem, start: &[f64], free: &[usize], noise: f64) -> Result<Rank, FitError> {
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
    let columns = full.select_columns(&order);
    let first_link = order.iter().any(|&p| parameters[p].link == Some(0) && parameters[p].effect == "mdh");
    let tolerance = |(k, &p): (usize, &usize)| {
        let Parameter { owner, effect, link, spec, .. } = &parameters[p];
        let near_lock = first_link && (effect == "base_frame" || effect == "mdh" && *link == Some(0));
        let faint = if *owner == Owner::Robot { FAINT * noise / (spec.prior * columns.column(k).norm()) } else { 0.0 };
        faint.max(if near_lock { LOCKED } else { RANK_TOLERANCE })
    };
    let tolerances: Vec<f64> = order.iter().enumerate().map(tolerance).collect();
    let OrderedRank { kept, dependent } = linalg::ordered_independent_columns(&columns, &tolerances);
    let (definition, mut kept): (Vec<usize>, Vec<usize>) =
        kept.into_iter().map(|k| order[k]).partition(|&p| parameters[p].defines_world);
    kept.sort_unstable();
    let mut unresolved: Vec<Unresolved> = dependent
        .into_iter()
        .map(|d| {
            let mut with = d.combination;
            with.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
            Unresolved { parameter: order[d.column], with: with.into_iter().map(|(k, _)| order[k]).collect() }
        })
        .collect();
    // What defines the world took part so that link 1, which could stand in for the base, does not float in its place.
    let of_artifact = |home: Option<usize>| {
        let unknown = move |p: &usize| parameters[*p].owner == Owner::Artifact && parameters[*p].setup == home;
        order.iter().copied().filter(unknown).collect()
    };
    unresolved.extend(definition.into_iter().map(|p| Unresolved { parameter: p, with: of_artifact(parameters[p].setup) }));
    unresolved.sort_by_key(|u| u.parameter);
    Ok(Rank { kept, unresolved })
}
