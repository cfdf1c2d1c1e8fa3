//! The ways down: by strides where loads follow quickly, else by steps that are taken only where chi-square under the loads there is lower.

use super::Adjustment;
use crate::identify::Problem;
use crate::identify::fit::{FitError, Outcome};

/// Where nothing depends on the values, the fit has converged when the predicted change of the whitened residual vector is shorter than
/// this.
const STEP_TOLERANCE: f64 = 1e-8;

/// Where loads depend on the values: the same by exact columns, in sigmas of what is left.
const GRADIENT_TOLERANCE: f64 = 1e-3;

const MAX_ITERATIONS: usize = 60;

/// The same where loads depend on the values: a product of parameters bends more than what they are the sum of, and a campaign of fifty
/// poses beside larger ones, or of twenty alone, leaves a narrow valley that takes a thousand.
const MOST_UNDER_LOADS: usize = 1200;

/// Steps that end where loads are computed anew have converged when what is left of them is shorter than this; they shrink by the ratio of
/// deflection to arm length or faster.
const LEFT_OVER: f64 = 1e-5;

/// A step of exact differences, in units of each parameter's uncertainty, all others known.
const DIFFERENCE: f64 = 1e-2;

/// By how much chi-square under the loads at the values may differ from what the fast path left.
const SAME: f64 = 1e-6;

/// And by this share of the variance of unit weight, a tenth of a sigma, which no conclusion rests on.
const OF_A_SIGMA: f64 = 1e-2;

/// Holds a parameter where it is.
const HELD: f64 = 1e12;

impl Adjustment {
    /// Brings all but what acts through the compliances near the minimum: a load and a compliance enter as their product, and of a
    /// compliance that is not known yet any load may be made.
    pub(super) fn approach(&mut self, problem: &Problem, start: &[f64]) -> Result<(), FitError> {
        let parameters = problem.parameters();
        if self.kept.iter().any(|&p| parameters[p].through && start[p] != 0.0) {
            return Ok(());
        }
        let information = self.information.clone();
        for (information, &p) in self.information.iter_mut().zip(&self.kept) {
            if parameters[p].through {
                *information = HELD / parameters[p].spec.prior.powi(2);
            }
        }
        let arrived = self.stride(problem);
        self.information = information;
        let through = self.kept.iter().filter(|&&p| parameters[p].through);
        through.for_each(|&p| self.values[p] = start[p]);
        self.trial.copy_from_slice(start);
        let begun = self.chi2_at(problem, true)?;
        if !arrived || self.chi2_at(problem, false)? > begun {
            self.values.copy_from_slice(start);
        }
        Ok(())
    }

    /// Computes the loads where each step ends and steps on from there, as long as every step is at most half of the one before; whether
    /// that led to the end. Sums of squares cannot tell: under other loads they are others.
    pub(super) fn stride(&mut self, problem: &Problem) -> bool {
        let mut before: Option<f64> = None;
        self.exact = false;
        // Which of the two states holds the present loads.
        let mut present: Option<usize> = None;
        if self.values.iter().any(|&v| v != 0.0) {
            self.settle(problem, false);
            present = Some(1);
        }
        while self.iterations < MAX_ITERATIONS {
            if before.is_some() {
                let next = present.map_or(0, |present| 1 - present);
                let [first, second] = &mut self.states;
                let (into, under) = if next == 0 { (first, second) } else { (second, first) };
                let under = if present.is_some() { &*under } else { problem.nominal_loads() };
                problem.load(under, &self.values, into, &mut self.room);
                present = Some(next);
            }
            let state = present.map_or(problem.nominal_loads(), |present| &self.states[present]);
            problem.linearise(&self.values, state, &mut self.work, &mut self.near);
            self.chi2 = self.near.chi2() + self.penalty(&self.values);
            self.form_normal_equations();
            if !self.chi2.is_finite() || self.factor_scaled(0.0).is_err() {
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
                self.outcome = Outcome::Converged;
                return true;
            }
            before = Some(length);
        }
        false
    }

    /// Steps down from the present values until no step lowers chi-square under the loads at the values.
    pub(super) fn descend(&mut self, problem: &Problem) -> Result<(), FitError> {
        let depends = problem.depends_on_values();
        self.linearise(problem, false);
        if !self.chi2.is_finite() {
            return Err(FitError::NotFinite);
        }
        self.form_normal_equations();
        let mut lambda = 0.0;
        self.outcome = Outcome::IterationLimit;
        let (least, down, most) = if depends { (1e-4, 30.0, MOST_UNDER_LOADS) } else { (1e-6, 10.0, MAX_ITERATIONS) };
        let last = self.iterations + problem.most_steps().unwrap_or(most);
        while self.iterations < last {
            if self.factor_scaled(lambda).is_err() {
                if lambda > 1e6 {
                    return Err(FitError::Singular);
                }
                lambda = f64::max(10.0 * lambda, 1e-10);
                continue;
            }
            let length = self.solve();
            let tolerance = if depends { self.gradient_tolerance() } else { STEP_TOLERANCE };
            if lambda == 0.0 && length < tolerance {
                if depends && !self.exact {
                    self.find_exact_columns(problem);
                    continue;
                }
                // So short a step changes chi-square by its square and the normal matrix less: neither is evaluated again.
                if !depends {
                    self.iterations += 1;
                    std::mem::swap(&mut self.values, &mut self.trial);
                }
                self.outcome = Outcome::Converged;
                break;
            }
            self.iterations += 1;
            let before = self.chi2;
            self.linearise(problem, true);
            // Within rounding of the sum of squares a step of the last digits may go either way.
            if self.chi2.is_finite() && self.chi2 <= before * (1.0 + 1e-12) + 1e-18 {
                std::mem::swap(&mut self.values, &mut self.trial);
                self.exact = false;
                self.form_normal_equations();
                lambda = if lambda < 1e-8 { 0.0 } else { lambda / down };
                continue;
            }
            self.chi2 = before;
            if depends && !self.exact {
                self.find_exact_columns(problem);
                continue;
            }
            if length < 1e-5 || lambda > 1e8 {
                // Nothing is left to gain but rounding.
                let left = length * (1.0 + lambda).sqrt();
                self.outcome = if length < 1e-5 && left < tolerance.max(1e-5) { Outcome::Converged } else { Outcome::Stalled };
                break;
            }
            lambda = f64::max(10.0 * lambda, least);
        }
        Ok(())
    }

    /// Linearises the problem at the present values, or at the trial ones, under the loads there, and takes chi-square.
    fn linearise(&mut self, problem: &Problem, trial: bool) {
        self.settle(problem, trial);
        let values = if trial { &self.trial } else { &self.values };
        let state = if problem.depends_on_values() { &self.states[1] } else { problem.nominal_loads() };
        problem.linearise(values, state, &mut self.work, &mut self.near);
        self.chi2 = self.near.chi2() + self.penalty(values);
    }

    fn settle(&mut self, problem: &Problem, trial: bool) {
        if problem.depends_on_values() {
            let [once, twice] = &mut self.states;
            problem.settle(if trial { &self.trial } else { &self.values }, [once, twice], &mut self.room);
        }
    }

    /// Chi-square under the loads at the present values, or at the trial ones.
    fn chi2_at(&mut self, problem: &Problem, trial: bool) -> Result<f64, FitError> {
        self.settle(problem, trial);
        let values = if trial { &self.trial } else { &self.values };
        let state = if problem.depends_on_values() { &self.states[1] } else { problem.nominal_loads() };
        problem.linearise(values, state, &mut self.work, &mut self.alone);
        let chi2 = self.alone.chi2() + self.penalty(values);
        if chi2.is_finite() { Ok(chi2) } else { Err(FitError::NotFinite) }
    }

    /// Makes the columns at the present values exact, by differences: with how the loads follow the parameters.
    fn find_exact_columns(&mut self, problem: &Problem) {
        self.exact = true;
        self.settle(problem, false);
        problem.linearise(&self.values, &self.states[1], &mut self.work, &mut self.near);
        self.trial.copy_from_slice(&self.values);
        let residuals = self.kept.len();
        for k in 0..residuals {
            let (p, step) = (self.kept[k], DIFFERENCE * self.scale[k]);
            self.trial[p] += step;
            self.settle(problem, true);
            problem.linearise(&self.trial, &self.states[1], &mut self.work, &mut self.alone);
            self.trial[p] = self.values[p];
            for (mut here, there) in self.near.transposed.column_iter_mut().zip(self.alone.transposed.iter()) {
                here[k] = (here[residuals] - there) / step;
            }
        }
        self.form_normal_equations();
    }

    /// Holds chi-square of the fast path against the one under the loads at the values, and against the one at `start`; goes on from the
    /// better of both places where it does not hold.
    ///
    /// # Errors
    /// When the numbers are not finite.
    pub(in crate::identify) fn confirm(&mut self, problem: &Problem, start: &[f64]) -> Result<(), FitError> {
        let chi2 = self.chi2_at(problem, false)?;
        let unit = if self.dof == 0 { 1.0 } else { chi2 / self.dof as f64 };
        let same = (chi2 - self.chi2).abs() <= SAME * chi2 + OF_A_SIGMA * unit;
        self.trial.copy_from_slice(start);
        let begun = self.chi2_at(problem, true)?;
        let worse = begun < chi2 && self.kept.iter().any(|&p| start[p] != 0.0);
        if worse {
            self.values.copy_from_slice(start);
        }
        if worse || !same {
            return self.descend(problem);
        }
        self.chi2 = chi2;
        Ok(())
    }

    /// [`GRADIENT_TOLERANCE`] in units of the noise stated, or of what is left where that is more or nothing is stated.
    fn gradient_tolerance(&self) -> f64 {
        let left = if self.dof == 0 { 1.0 } else { self.chi2 / self.dof as f64 };
        GRADIENT_TOLERANCE * if self.noise_stated { left.max(1.0) } else { left.max(1e-6) }.sqrt()
    }
}
