//! The least-squares adjustment: Gauss-Newton with column scaling, damped (Levenberg-Marquardt) only when a step fails.
//!
//! Minimises `|W (y - f(rho))|² + sum over stated parameters ((rho - rho_0) / sigma)²`.

mod descent;

use nalgebra::{DMatrix, DVector};

use super::determined::{Determined, determined, observability_at};
use super::fit_result::{Fit, FitError, Outcome, Unresolved};
use super::problem::{Linearised, LoadState, LoadWorkspace, Workspace};
use super::problem::{Prior, Problem};
use crate::math::linalg::{self, Cholesky};
use crate::math::{Observability, rms};

/// An adjustment set up once for a problem, and run as often as its samples are [renewed](Problem::renew).
///
/// Which parameters the data can separate depends on the poses and is determined at set-up; nothing is allocated after
/// that.
pub struct Adjustment {
    kept: Vec<usize>,
    unresolved: Vec<Unresolved>,
    /// 1/sigma² of the kept parameters; zero if flat.
    information: Vec<f64>,
    values: Vec<f64>,
    trial: Vec<f64>,
    work: Workspace,
    near: Linearised,
    /// The residuals without derivatives.
    alone: Linearised,
    room: LoadWorkspace,
    states: [LoadState; 2],
    /// True if the columns at the present values include the dependence of the loads on the parameters.
    exact: bool,
    /// What that dependence added to the columns where it was last found (kept x rows); empty before.
    through_loads: DMatrix<f64>,
    /// True if these columns are found from settled loads.
    settled_columns: bool,
    /// `[J r]^T [J r]`, plus the information of the priors.
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
    outcome: Outcome,
}

impl Adjustment {
    /// Finds which of the parameters `free` (ascending) the samples can separate at `start` (deviations, SI); the others
    /// stay there.
    ///
    /// # Errors
    /// When there are fewer residuals than unknowns or a value is not finite.
    pub fn new(problem: &Problem, start: &[f64], free: &[usize]) -> Result<Self, FitError> {
        let determined = determined(problem, start, free, problem.noise_at(start))?;
        Ok(Adjustment::of(problem, determined))
    }

    pub(super) fn of(problem: &Problem, Determined { kept, unresolved }: Determined) -> Self {
        let parameters = problem.parameters();
        let unknowns = kept.len();
        let flat = kept.iter().filter(|&&p| parameters[p].knowledge == Prior::Uninformative).count();
        let information = kept.iter().map(|&p| problem.information(p));
        Adjustment {
            information: information.collect(),
            values: problem.start(),
            trial: problem.start(),
            work: Workspace::new(problem.robot()),
            near: Linearised::new(problem, &kept),
            alone: Linearised::new(problem, &[]),
            room: LoadWorkspace::new(problem.robot()),
            states: Default::default(),
            exact: false,
            through_loads: DMatrix::zeros(0, 0),
            settled_columns: false,
            normal: DMatrix::zeros(unknowns + 1, unknowns + 1),
            scaled: DMatrix::zeros(unknowns, unknowns),
            gradient: DVector::zeros(unknowns),
            scale: DVector::zeros(unknowns),
            step: DVector::zeros(unknowns),
            factor: Cholesky::new(unknowns),
            kept,
            unresolved,
            chi2: f64::NAN,
            dof: problem.dof(flat),
            noise_stated: problem.noise_stated(),
            iterations: 0,
            outcome: Outcome::IterationLimit,
        }
    }

    /// Estimated parameters, ascending.
    pub fn kept(&self) -> &[usize] {
        &self.kept
    }

    /// Deviation of every parameter of the problem from nominal after the last adjustment, SI.
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

    /// Number of steps of the last adjustment.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Outcome of the last adjustment.
    pub fn outcome(&self) -> Outcome {
        self.outcome
    }

    /// Adjusts the parameters to the samples of `problem`, from `start` (deviations, SI).
    ///
    /// The problem is the one for which the adjustment was set up, or the same one [renewed](Problem::renew).
    ///
    /// # Errors
    /// When a value is not finite.
    pub fn adjust(&mut self, problem: &Problem, start: &[f64]) -> Result<(), FitError> {
        assert_eq!(
            (problem.row_count(), start.len()),
            (self.near.transposed.ncols(), self.values.len()),
            "an adjustment serves one problem"
        );
        self.noise_stated = problem.noise_stated();
        self.values.copy_from_slice(start);
        self.iterations = 0;
        self.through_loads = DMatrix::zeros(0, 0);
        self.settled_columns = false;
        if !problem.depends_on_values() {
            return self.descend(problem);
        }
        if problem.acts_through_compliance() {
            self.approach(problem, start)?;
        } else if self.stride(problem) {
            return Ok(());
        } else {
            self.values.copy_from_slice(start);
        }
        self.descend(problem)
    }

    /// Computes the step from the factored normal matrix, and the values it leads to. Returns its length, |J step| except
    /// for the damping: the change of the whitened residuals, however ill-determined the unknowns are.
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

    /// Normal matrix and gradient at the values of the last linearisation, which are the present ones.
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

    /// Variance of unit weight: one if the noise is stated.
    fn unit_variance(&self) -> f64 {
        if self.noise_stated || self.dof == 0 { 1.0 } else { self.chi2 / self.dof as f64 }
    }

    /// Covariance of the kept parameters (kept x kept), SI; scaled by chi-square per degree of freedom if the noise is not
    /// stated.
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

    /// Returns the last adjustment with its statistics.
    ///
    /// # Errors
    /// When a decomposition fails.
    pub fn into_fit(mut self, problem: &Problem) -> Result<Fit, FitError> {
        let covariance = self.covariance()?;
        let parameters = problem.parameters();
        let flat: Vec<usize> = self.kept.iter().copied().filter(|&p| parameters[p].knowledge == Prior::Uninformative).collect();
        let (observability, condition) = match problem.gives_indices() {
            true => observability_at(problem, &self.values, &flat)?,
            false => (Observability::UNKNOWN, f64::NAN),
        };
        let state = problem.load_state(&self.values);
        let residuals = problem.residuals_under(&self.values, &state);
        let outcome = if problem.left_linear_range_under(&self.values, &state).is_some() {
            Outcome::LeftLinearRange
        } else {
            self.outcome
        };
        let turns: Vec<_> = problem.orientation_residuals(&self.values).into_iter().flatten().collect();
        Ok(Fit {
            rms_orientation: (!turns.is_empty()).then(|| rms(&turns)),
            values: self.values,
            kept: self.kept,
            covariance,
            unresolved: self.unresolved,
            rms: rms(&residuals),
            chi2: self.chi2,
            dof: self.dof,
            noise_stated: self.noise_stated,
            iterations: self.iterations,
            outcome,
            observability,
            condition,
        })
    }
}
