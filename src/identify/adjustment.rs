//! The least-squares adjustment: Gauss-Newton with column scaling, damped (Levenberg-Marquardt) only when a step fails.
//!
//! Minimises `|W (y - f(rho))|² + sum over stated parameters ((rho - rho_0) / sigma)²`.

use nalgebra::{DMatrix, DVector};

use super::fit::{self, Determined, Fit, FitError, Stop, Unresolved};
use super::linalg::{self, Cholesky};
use super::problem::{Linearised, Workspace};
use super::{Knowledge, Problem};

/// The fit has converged when the predicted change of the whitened residual vector is shorter than this.
const STEP_TOLERANCE: f64 = 1e-8;

const MAX_ITERATIONS: usize = 60;

/// Steps that end in a posture weighed anew have converged when what is left of them is shorter than this; they shrink by the ratio of
/// deflection to arm length or faster.
const LEFT_OVER: f64 = 1e-5;

/// The posture has settled when a weighing changes no combination of parameters by more than this share of its uncertainty.
const SETTLED: f64 = 1e-3;

/// Each weighing shrinks the change by the ratio of deflection to arm length, about 1e-2: three are enough.
const MOST_WEIGHINGS: usize = 5;

/// Where an effect acts through the compliances sought, it shrinks by the share of a joint's torque that was not entered: about a half
/// for a wrist that carries the payload's centre of mass a centimetre beside where it was said to be.
const MOST_WEIGHINGS_THROUGH_COMPLIANCE: usize = 100;

/// An adjustment laid out once for a problem, and made as often as its samples are [renewed](Problem::renew).
///
/// Which parameters the data can tell apart is a matter of the poses and is found when it is laid out; nothing is allocated after that.
pub struct Adjustment {
    kept: Vec<usize>,
    unresolved: Vec<Unresolved>,
    /// 1/sigma² of the kept parameters; zero when flat.
    information: Vec<f64>,
    values: Vec<f64>,
    trial: Vec<f64>,
    work: Workspace,
    near: Linearised,
    /// `[J r]^T [J r]`, and the information of what is stated.
    normal: DMatrix<f64>,
    scaled: DMatrix<f64>,
    gradient: DVector<f64>,
    /// 1/sqrt of the normal matrix's diagonal.
    scale: DVector<f64>,
    step: DVector<f64>,
    factor: Cholesky,
    chi2: f64,
    dof: usize,
    noise_stated: bool,
    iterations: usize,
    stop: Stop,
}

impl Adjustment {
    /// Finds which of the parameters `free` (ascending) the samples tell apart at `start` (deviations, SI); the others stay there.
    ///
    /// # Errors
    /// When there are fewer residuals than unknowns or the numbers are not finite.
    pub fn new(problem: &Problem, start: &[f64], free: &[usize]) -> Result<Self, FitError> {
        let determined = fit::determined(problem, start, free, problem.noise_at(start))?;
        Ok(Adjustment::of(problem, determined))
    }

    pub(super) fn of(problem: &Problem, Determined { kept, unresolved }: Determined) -> Self {
        let parameters = problem.parameters();
        let (rows, unknowns) = (problem.row_count(), kept.len());
        let flat = kept.iter().filter(|&&p| parameters[p].knowledge == Knowledge::Flat).count();
        let information = kept.iter().map(|&p| parameters[p].knowledge.information());
        Adjustment {
            information: information.collect(),
            values: problem.start(),
            trial: problem.start(),
            work: Workspace::new(problem.robot()),
            near: Linearised::new(problem, &kept),
            normal: DMatrix::zeros(unknowns + 1, unknowns + 1),
            scaled: DMatrix::zeros(unknowns, unknowns),
            gradient: DVector::zeros(unknowns),
            scale: DVector::zeros(unknowns),
            step: DVector::zeros(unknowns),
            factor: Cholesky::new(unknowns),
            kept,
            unresolved,
            chi2: f64::NAN,
            dof: rows - flat,
            noise_stated: problem.noise_stated(),
            iterations: 0,
            stop: Stop::IterationLimit,
        }
    }

    /// Parameters that are estimated, ascending.
    pub fn kept(&self) -> &[usize] {
        &self.kept
    }

    /// Deviation of every parameter of the problem from the drawing after the last adjustment, SI.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Whitened sum of squares after the last adjustment, stated parameters included.
    pub fn chi2(&self) -> f64 {
        self.chi2
    }

    /// Residuals minus flat unknowns.
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Steps of the last adjustment.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Why it ended.
    pub fn stop(&self) -> Stop {
        self.stop
    }

    /// Adjusts the parameters to the samples of `problem`, from `start` (deviations, SI).
    ///
    /// The problem is the one that the adjustment was laid out for, or the same [renewed](Problem::renew).
    ///
    /// # Errors
    /// When the numbers are not finite.
    pub fn adjust(&mut self, problem: &mut Problem, start: &[f64]) -> Result<(), FitError> {
        assert_eq!(
            (problem.row_count(), start.len()),
            (self.near.transposed.ncols(), self.values.len()),
            "an adjustment serves one problem"
        );
        self.noise_stated = problem.noise_stated();
        self.values.copy_from_slice(start);
        self.iterations = 0;
        if !problem.depends_on_values() {
            return self.descend(problem, STEP_TOLERANCE);
        }
        let through = problem.acts_through_compliance();
        if !through {
            if self.stride(problem) {
                return Ok(());
            }
            self.values.copy_from_slice(start);
            problem.reweigh(start);
        }
        // Torques that will be weighed anew deserve no more digits than the weighing will leave.
        self.descend(problem, SETTLED)?;
        let mut weighed = if through { start.to_vec() } else { self.values.clone() };
        let most = if through { MOST_WEIGHINGS_THROUGH_COMPLIANCE } else { MOST_WEIGHINGS };
        // A load and a compliance enter as their product: full steps of one against the other may swing ever further, half steps settle.
        let share = if through { 0.5 } else { 1.0 };
        for _ in 0..most {
            weighed.iter_mut().zip(&self.values).for_each(|(w, v)| *w += share * (v - *w));
            problem.reweigh(&weighed);
            self.descend(problem, SETTLED)?;
            if self.sigmas_from(&weighed) < SETTLED {
                break;
            }
        }
        self.descend(problem, STEP_TOLERANCE)
    }

    /// Weighs the arm where each step ends and steps on from there, as long as every step is at most half of the one before; whether that
    /// led to the end. Sums of squares cannot tell: each weighing changes them.
    fn stride(&mut self, problem: &mut Problem) -> bool {
        let mut before: Option<f64> = None;
        while self.iterations < MAX_ITERATIONS {
            if before.is_some() {
                problem.reweigh(&self.values);
            }
            if self.linearise(problem).is_err() || self.factor_scaled(0.0).is_err() {
                return false;
            }
            let length = self.solve();
            // The first has none before it: as much again may be left.
            let ratio = before.map_or(0.5, |before| length / before);
            if ratio > 0.5 || ratio.is_nan() {
                return false;
            }
            self.iterations += 1;
            std::mem::swap(&mut self.values, &mut self.trial);
            if length * ratio / (1.0 - ratio) < LEFT_OVER {
                self.chi2 = (self.chi2 - length * length).max(0.0);
                self.stop = Stop::Converged;
                return true;
            }
            before = Some(length);
        }
        false
    }

    /// Steps down from the present values until a step is shorter than `tolerance`.
    fn descend(&mut self, problem: &Problem, tolerance: f64) -> Result<(), FitError> {
        self.linearise(problem)?;
        let mut lambda = 0.0;
        self.stop = Stop::IterationLimit;
        let last = self.iterations + MAX_ITERATIONS;
        while self.iterations < last {
            if self.factor_scaled(lambda).is_err() {
                if lambda > 1e6 {
                    return Err(FitError::Singular);
                }
                lambda = f64::max(10.0 * lambda, 1e-10);
                continue;
            }
            let length = self.solve();
            self.iterations += 1;
            if lambda == 0.0 && length < tolerance {
                // So short a step changes chi-square by its square and the normal matrix less: neither is evaluated again.
                std::mem::swap(&mut self.values, &mut self.trial);
                self.stop = Stop::Converged;
                break;
            }
            problem.linearise(&self.trial, &mut self.work, &mut self.near);
            let chi2 = self.near.chi2() + self.penalty(&self.trial);
            // Within rounding of the sum of squares a step of the last digits may go either way.
            if chi2.is_finite() && chi2 <= self.chi2 * (1.0 + 1e-12) + 1e-18 {
                std::mem::swap(&mut self.values, &mut self.trial);
                self.chi2 = chi2;
                self.form_normal_equations();
                lambda = if lambda < 1e-8 { 0.0 } else { lambda / 10.0 };
            } else {
                if length < 1e-5 || lambda > 1e8 {
                    self.stop = Stop::NoFurtherDescent;
                    break;
                }
                lambda = f64::max(10.0 * lambda, 1e-6);
            }
        }
        Ok(())
    }

    /// Linearises the problem at the present values.
    fn linearise(&mut self, problem: &Problem) -> Result<(), FitError> {
        problem.linearise(&self.values, &mut self.work, &mut self.near);
        self.chi2 = self.near.chi2() + self.penalty(&self.values);
        if !self.chi2.is_finite() {
            return Err(FitError::NotFinite);
        }
        self.form_normal_equations();
        Ok(())
    }

    /// Finds the step of the normal matrix as it was factored, and the values where it ends; its length, |J step| but for the damping:
    /// what it does to the whitened residuals, however ill-determined the unknowns.
    fn solve(&mut self) -> f64 {
        self.step.copy_from(&self.gradient);
        self.step.component_mul_assign(&self.scale);
        self.factor.solve_in_place(self.step.as_mut_slice());
        self.trial.copy_from_slice(&self.values);
        for (k, &p) in self.kept.iter().enumerate() {
            self.trial[p] += self.step[k] * self.scale[k];
        }
        let terms = self.step.iter().zip(&self.gradient).zip(&self.scale);
        terms.map(|((step, gradient), scale)| step * gradient * scale).sum::<f64>().max(0.0).sqrt()
    }

    /// Normal matrix and gradient at the values where the problem was last linearised, which are the present ones.
    fn form_normal_equations(&mut self) {
        linalg::normal_matrix(&self.near.transposed, &mut self.normal);
        for (k, &p) in self.kept.iter().enumerate() {
            self.normal[(k, k)] += self.information[k];
            self.gradient[k] = self.normal[(k, self.kept.len())] - self.information[k] * self.values[p];
            self.scale[k] = 1.0 / self.normal[(k, k)].sqrt();
        }
    }

    /// Factors the normal matrix, scaled to a unit diagonal, with `lambda` added to it.
    fn factor_scaled(&mut self, lambda: f64) -> Result<(), FitError> {
        let m = self.kept.len();
        for c in 0..m {
            for row in c..m {
                self.scaled[(row, c)] = self.normal[(row, c)] * self.scale[row] * self.scale[c];
            }
            self.scaled[(c, c)] += lambda;
        }
        Ok(self.factor.factor(&self.scaled)?)
    }

    fn penalty(&self, values: &[f64]) -> f64 {
        self.kept.iter().zip(&self.information).map(|(&p, &w)| w * values[p] * values[p]).sum()
    }

    /// Variance of unit weight: one where the noise is stated.
    fn unit_variance(&self) -> f64 {
        if self.noise_stated || self.dof == 0 { 1.0 } else { self.chi2 / self.dof as f64 }
    }

    /// Distance from other values in units of uncertainty: the largest that any combination of parameters shows.
    fn sigmas_from(&self, values: &[f64]) -> f64 {
        let change = DVector::from_iterator(self.kept.len(), self.kept.iter().map(|&p| self.values[p] - values[p]));
        let normal = self.normal.view((0, 0), (change.len(), change.len()));
        ((normal * &change).dot(&change) / self.unit_variance()).sqrt()
    }

    /// Covariance of the kept parameters (kept x kept), SI; scaled by chi-square per degree of freedom where the noise is not stated.
    ///
    /// # Errors
    /// When the normal matrix cannot be factored.
    pub fn covariance(&mut self) -> Result<DMatrix<f64>, FitError> {
        self.factor_scaled(0.0)?;
        let mut covariance = DMatrix::zeros(self.kept.len(), self.kept.len());
        self.factor.inverse(&mut covariance);
        let unit = self.unit_variance();
        for (c, mut column) in covariance.column_iter_mut().enumerate() {
            column.component_mul_assign(&self.scale);
            column *= self.scale[c] * unit;
        }
        Ok(covariance)
    }

    /// The last adjustment with all that is said of it.
    ///
    /// # Errors
    /// When a decomposition fails.
    pub fn into_fit(mut self, problem: &Problem) -> Result<Fit, FitError> {
        let covariance = self.covariance()?;
        let parameters = problem.parameters();
        let flat: Vec<usize> = self.kept.iter().copied().filter(|&p| parameters[p].knowledge == Knowledge::Flat).collect();
        let (observability, condition) = fit::observability_at(problem, &self.values, &flat)?;
        let residuals = problem.residuals(&self.values);
        let rms = (residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / residuals.len() as f64).sqrt();
        Ok(Fit {
            values: self.values,
            kept: self.kept,
            covariance,
            unresolved: self.unresolved,
            rms,
            chi2: self.chi2,
            dof: self.dof,
            noise_stated: self.noise_stated,
            iterations: self.iterations,
            stop: self.stop,
            observability,
            condition,
        })
    }
}
