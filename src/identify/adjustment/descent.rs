//! Iteration: undamped strides if loads follow quickly, otherwise steps accepted only if they lower chi-square under the
//! loads at their end.

use super::Adjustment;
use crate::identify::fit_result::{FitError, Outcome};
use crate::identify::problem::Problem;

/// If nothing depends on the values, the fit has converged when the predicted change of the whitened residual vector is
/// shorter than this.
const STEP_TOLERANCE: f64 = 1e-8;

/// The same if loads depend on the values: from exact columns, in sigmas of the residual.
const GRADIENT_TOLERANCE: f64 = 1e-3;

/// Limit on the Gauss-Newton steps if nothing depends on the values.
const MAX_ITERATIONS: usize = 60;

/// Step limit if loads depend on the values: a product of parameters is more curved than a sum, and a campaign of fifty
/// poses combined with larger ones, or of twenty alone, leaves a narrow valley that takes a thousand.
const MOST_UNDER_LOADS: usize = 1200;

/// Steps with loads recomputed at their end have converged when the remaining distance is shorter than this; they shrink by
/// the ratio of deflection to arm length or faster.
const LEFT_OVER: f64 = 1e-5;

/// Step of exact differences, in units of each parameter's uncertainty with all others known.
const DIFFERENCE: f64 = 1e-2;

/// Allowed relative difference of chi-square under the loads at the values from that of the fast path.
const SAME: f64 = 1e-6;

/// In addition, this share of the variance of unit weight, a tenth of a sigma, on which no conclusion rests.
const OF_A_SIGMA: f64 = 1e-2;

/// Information that fixes a parameter at its value.
const HELD: f64 = 1e12;

impl Adjustment {
    /// Brings all parameters except those that act through the compliances near the minimum: a load and a compliance enter
    /// as their product, and with an unknown compliance the load is arbitrary.
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

    /// Recomputes the loads at the end of each step and continues from there, as long as every step is at most half of the
    /// previous one. Returns true if it converged. Sums of squares are not a criterion: they differ under other loads.
    pub(super) fn stride(&mut self, problem: &Problem) -> bool {
        let mut before: Option<f64> = None;
        self.exact = false;
        // Index of the state that holds the present loads.
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
            // The first step has no predecessor: assume that as much again may remain.
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

    /// Descends from the present values until no step lowers chi-square under the loads at the values.
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
        let mut looked = self.iterations;
        while self.iterations < last {
            if self.iterations >= looked + MAX_ITERATIONS {
                looked = self.iterations;
                // After so many steps a descent that is at no arm does not come back to one.
                if problem.left_linear_range(&self.values).is_some() {
                    self.outcome = Outcome::LeftLinearRange;
                    break;
                }
            }
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
                // So short a step changes chi-square by its square and the normal matrix by less: neither is evaluated
                // again.
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
            // Within rounding of the sum of squares, a step in the last digits may go either way.
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
                // Only rounding remains to be gained.
                let left = length * (1.0 + lambda).sqrt();
                self.outcome = if length < 1e-5 && left < tolerance.max(1e-5) { Outcome::Converged } else { Outcome::Stalled };
                if self.outcome == Outcome::Stalled && depends && !self.settled_columns {
                    self.settled_columns = true;
                    self.find_exact_columns(problem);
                    lambda = 0.0;
                    continue;
                }
                break;
            }
            lambda = f64::max(10.0 * lambda, least);
        }
        Ok(())
    }

    /// Linearises the problem at the present or the trial values under the loads there, and computes chi-square.
    fn linearise(&mut self, problem: &Problem, trial: bool) {
        self.settle(problem, trial);
        let values = if trial { &self.trial } else { &self.values };
        let state = if problem.depends_on_values() { &self.states[1] } else { problem.nominal_loads() };
        problem.linearise(values, state, &mut self.work, &mut self.near);
        self.chi2 = self.near.chi2() + self.penalty(values);
        // The dependence of the loads changes little between steps: without it a descent crawls along narrow valleys.
        if !self.through_loads.is_empty() {
            let mut columns = self.near.transposed.rows_mut(0, self.kept.len());
            columns += &self.through_loads;
        }
    }

    fn settle(&mut self, problem: &Problem, trial: bool) {
        if problem.depends_on_values() {
            let [once, twice] = &mut self.states;
            problem.settle(if trial { &self.trial } else { &self.values }, [once, twice], &mut self.room);
        }
    }

    /// Chi-square under the loads at the present or the trial values.
    fn chi2_at(&mut self, problem: &Problem, trial: bool) -> Result<f64, FitError> {
        self.settle(problem, trial);
        let values = if trial { &self.trial } else { &self.values };
        let state = if problem.depends_on_values() { &self.states[1] } else { problem.nominal_loads() };
        problem.linearise(values, state, &mut self.work, &mut self.alone);
        let chi2 = self.alone.chi2() + self.penalty(values);
        if chi2.is_finite() { Ok(chi2) } else { Err(FitError::NotFinite) }
    }

    /// Makes the columns at the present values exact by differences, including the dependence of the loads on the
    /// parameters: one step of the loads from those at the present values, or settled ones if a descent has stalled with those.
    fn find_exact_columns(&mut self, problem: &Problem) {
        self.exact = true;
        self.settle(problem, false);
        let residuals = self.kept.len();
        for k in 0..=residuals {
            // The present values first, under loads made in the same way: a difference is smaller than that of two ways.
            let difference = k.checked_sub(1).map(|k| (k, self.kept[k], DIFFERENCE * self.scale[k]));
            self.trial.copy_from_slice(&self.values);
            if let Some((_, p, step)) = difference {
                self.trial[p] += step;
            }
            let state = if self.settled_columns {
                self.settle(problem, true);
                &self.states[1]
            } else {
                let [there, under] = &mut self.states;
                problem.load(under, &self.trial, there, &mut self.room);
                there
            };
            let Some((k, _, step)) = difference else {
                problem.linearise(&self.trial, state, &mut self.work, &mut self.near);
                self.through_loads = -self.near.transposed.rows(0, residuals);
                continue;
            };
            problem.linearise(&self.trial, state, &mut self.work, &mut self.alone);
            for (mut here, there) in self.near.transposed.column_iter_mut().zip(self.alone.transposed.iter()) {
                here[k] = (here[residuals] - there) / step;
            }
        }
        self.through_loads += self.near.transposed.rows(0, residuals);
        self.form_normal_equations();
    }

    /// Compares chi-square of the fast path with the one under the loads at the values, and with the one at `start`;
    /// continues by descent from the better of the two places if the first two differ or `start` is better.
    ///
    /// # Errors
    /// When a value is not finite.
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

    /// [`GRADIENT_TOLERANCE`] in units of the stated noise, or of the residual if that is larger or nothing is stated.
    fn gradient_tolerance(&self) -> f64 {
        let left = if self.dof == 0 { 1.0 } else { self.chi2 / self.dof as f64 };
        GRADIENT_TOLERANCE * if self.noise_stated { left.max(1.0) } else { left.max(1e-6) }.sqrt()
    }
}
