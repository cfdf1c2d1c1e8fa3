//! A fit of all unknowns that the data can separate: adjustments are repeated until that selection agrees with the
//! solution.

pub use super::determined::{independent_parameters, observability_of};
pub use super::fit_result::{Fit, FitError, Outcome, Unresolved};
pub(crate) use super::model_error::covariance_with_model_error;

use super::asked_again::asked_again;
use super::determined::{all, determined_with};

use super::Adjustment;
use super::problem::Problem;
use crate::effects::{EffectId, Owner};

/// The columns are selected again after a fit that moved a tool or a ball by more plausible sizes than this, since they
/// have changed.
const FAR: f64 = 100.0;

/// Largest number of selections; on measured data the third has agreed with the second.
const MOST_JUDGEMENTS: usize = 4;

/// Parameters are held against residuals that exceed the noise by this factor, from one trial to the next.
const EXCESS: f64 = 1.2;

/// Beyond this factor the data do not fit the robot, and what they separate means nothing.
const MOST_EXCESS: f64 = 100.0;

/// Share of chi-square, and its amount, by which a larger model may fit worse: the residual error of loads that follow the
/// posture.
const NESTED: f64 = 1e-6;

/// Fits all unknowns of the problem from its start.
///
/// # Errors
/// When there are fewer residuals than unknowns or a value is not finite.
pub fn fit(problem: &Problem) -> Result<Fit, FitError> {
    let start = problem.start();
    fit_some(problem, &start, &all(problem))
}

/// Fits the parameters listed in `free` (ascending) and leaves the others at `start` (deviations, SI).
///
/// # Errors
/// As [`fit`].
pub(crate) fn fit_some(problem: &Problem, start: &[f64], free: &[usize]) -> Result<Fit, FitError> {
    fit_judged(problem, start, start, free, &[])
}

/// Fits all unknowns from the solution of a smaller model of the same samples; the separable parameters are selected at the
/// nominal start, as in [`fit`]; with `all_needed`, all that the smaller model was found to need are among them.
///
/// # Errors
/// As [`fit`].
fn fit_from(problem: &Problem, smaller: &Problem, solution: &Fit, all_needed: bool) -> Result<Fit, FitError> {
    let mut start = problem.start();
    let mut needed = Vec::new();
    for (k, (value, parameter)) in start.iter_mut().zip(problem.parameters()).enumerate() {
        let twin = smaller.parameters().iter().position(|p| p.name == parameter.name && p.effect == parameter.effect);
        if let Some(p) = twin {
            *value = smaller.parameters()[p].start + solution.values[p] - parameter.start;
            if all_needed && solution.kept.binary_search(&p).is_ok() {
                needed.push(k);
            }
        }
    }
    fit_judged(problem, &problem.start(), &start, &all(problem), &needed)
}

/// Fits all unknowns of a model that contains a smaller one with a known fit: from the nominal start, and if that ends
/// worse than the smaller one, from the smaller one's solution.
///
/// # Errors
/// As [`fit`]; [`FitError::WorseThanSmaller`] when it still fits worse.
pub fn fit_larger(problem: &Problem, smaller: &Problem, solution: &Fit) -> Result<Fit, FitError> {
    let larger = fit(problem)?;
    if check_nested(solution, &larger).is_ok() {
        return Ok(larger);
    }
    let larger = fit_from(problem, smaller, solution, false)?;
    if check_nested(solution, &larger).is_ok() {
        return Ok(larger);
    }
    let larger = fit_from(problem, smaller, solution, true)?;
    check_nested(solution, &larger)?;
    Ok(larger)
}

/// Checks that a model with more effects fits no worse than the one without them, on the same samples.
///
/// # Errors
/// [`FitError::WorseThanSmaller`].
pub fn check_nested(before: &Fit, after: &Fit) -> Result<(), FitError> {
    if after.chi2 <= before.chi2 * (1.0 + NESTED) + NESTED {
        return Ok(());
    }
    Err(FitError::WorseThanSmaller { before: before.chi2, after: after.chi2 })
}

/// Fits from `start` those of `free` that the data can separate at `judged`, whatever the plausible size of those in `needed`;
/// the others keep their values from there. Where that ends at no arm though the noise is stated, the parameters are held against
/// the residuals instead: what a noise far below them would separate, they do not.
fn fit_judged(problem: &Problem, judged: &[f64], start: &[f64], free: &[usize], needed: &[usize]) -> Result<Fit, FitError> {
    let first = fit_above(1.0, problem, judged, start, free, needed)?;
    let residual = |fit: &Fit| if fit.dof == 0 { 0.0 } else { (fit.chi2 / fit.dof as f64).sqrt() };
    let (mut noise, mut iterations) = (residual(&first), first.iterations);
    if first.outcome != Outcome::LeftLinearRange || !problem.noise_stated() || !(EXCESS..MOST_EXCESS).contains(&noise) {
        return Ok(first);
    }
    for _ in 1..MOST_JUDGEMENTS {
        let held = fit_above(noise, problem, judged, start, free, needed)?;
        iterations += held.iterations;
        if held.outcome != Outcome::LeftLinearRange {
            return Ok(Fit { iterations, ..held });
        }
        noise = noise.max(residual(&held)) * EXCESS;
    }
    Ok(first)
}

/// The same, the parameters held against this noise, in units of the stated one.
fn fit_above(
    floor: f64,
    problem: &Problem,
    judged: &[f64],
    start: &[f64],
    free: &[usize],
    needed: &[usize],
) -> Result<Fit, FitError> {
    let begin = |adjustment: &Adjustment, from: &[f64]| {
        let mut begin = judged.to_vec();
        adjustment.kept().iter().for_each(|&p| begin[p] = from[p]);
        begin
    };
    let separable = |at: &[f64], noise: f64| determined_with(problem, at, free, floor * noise, needed);
    let mut adjustment = Adjustment::of(problem, separable(judged, problem.noise_at(judged))?);
    let from = begin(&adjustment, start);
    adjustment.adjust(problem, &from)?;
    adjustment.confirm(problem, &from)?;
    let mut iterations = adjustment.iterations();
    let set_up = |p: usize| problem.parameters()[p].owner != Owner::Robot;
    // The nominal arm with the set-up as found: links rotated slightly by the fit would separate parameters that no nominal
    // model does.
    let found = |adjustment: &Adjustment| {
        let mut at = judged.to_vec();
        adjustment.kept().iter().filter(|&&p| set_up(p)).for_each(|&p| at[p] = adjustment.values()[p]);
        at
    };
    for _ in 1..MOST_JUDGEMENTS {
        let values = adjustment.values();
        // Not the base: the robot's pose in the world changes nothing within the arm.
        let guessed = |p: usize| set_up(p) && problem.parameters()[p].effect != EffectId::BASE_FRAME;
        let far = |&p: &usize| guessed(p) && (values[p] - judged[p]).abs() > FAR * problem.parameters()[p].spec.prior;
        if problem.noise_stated() && !adjustment.kept().iter().any(far) {
            break;
        }
        let at = found(&adjustment);
        let determined = separable(&at, problem.noise_at(values))?;
        if determined.kept == adjustment.kept() {
            break;
        }
        let warm = start != judged;
        let values = values.to_vec();
        adjustment = Adjustment::of(problem, determined);
        let from = begin(&adjustment, if warm { &values } else { &at });
        adjustment.adjust(problem, &from)?;
        adjustment.confirm(problem, &from)?;
        iterations += adjustment.iterations();
    }
    let at = found(&adjustment);
    let (adjustment, more) = asked_again(problem, judged, &at, free, adjustment)?;
    Ok(Fit { iterations: iterations + more, ..adjustment.into_fit(problem)? })
}
