//! A fit of all unknowns that the data can separate: adjustments are repeated until that selection agrees with the
//! solution.

pub use super::determined::{independent_parameters, observability_of};
pub use super::fit_result::{Fit, FitError, Outcome, Unresolved};
pub(crate) use super::model_error::covariance_with_model_error;

use super::asked_again::asked_again;
use super::determined::{all, determined_with};

use super::Adjustment;
use super::problem::{Prior, Problem, Use};
use crate::effects::{EffectId, Owner};
use crate::measure::dataset::NamedDataset;
use crate::measure::poses::Postures;

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

/// Largest number of times that the noise is estimated anew: each takes up most of what the one before left.
const MOST_NOISES: usize = 12;

/// A variance of the noise that falls by less than this factor has settled: sizes change by less than a hundredth of a sigma.
const SETTLED: f64 = 0.98;

/// Share of the degrees of freedom that must be left beside the plausible sizes: of fewer the noise is not known.
const LEAST_FREE: f64 = 0.5;

/// Smallest variance of unit weight: a thousandth of the noise that is supposed of data that state none, 0.1 um.
const FINEST: f64 = 1e-6;

/// Fits all unknowns of the problem from its start.
///
/// # Errors
/// When there are fewer residuals than unknowns or a value is not finite.
pub fn fit(problem: &Problem) -> Result<Fit, FitError> {
    let start = problem.start();
    fit_some(problem, &start, &all(problem))
}

/// A fit of a problem whose noise is not stated, its plausible sizes held against the noise that it leaves, and the problem with that
/// noise. The residuals of a tracker are far below the noise that is supposed of data that state none: against that, an effect that
/// they show exactly would be held near zero. With stated noise, and where nothing is gained, both stay as they are.
pub(crate) fn by_own_noise(datasets: &[NamedDataset<'_>], mut problem: Problem, mut fit: Fit) -> (Problem, Fit) {
    if problem.noise_stated() || !problem.is_held_plausibly() {
        return (problem, fit);
    }
    // Rows of one posture share what the arm errs there: they are not more than one row against a plausible size.
    let postures = Postures::of(datasets, |s| Use::Fit.takes(s)).count().max(1);
    let repetition = problem.sample_count() as f64 / postures as f64;
    for _ in 0..MOST_NOISES {
        let before = problem.unit_variance();
        let left = left_variance(&problem, &fit).map(|left| left * repetition);
        let Some(left) = left.filter(|left| *left < SETTLED * before) else { break };
        problem = problem.at_unit_variance(left);
        match fit_judged(&problem, &problem.start(), &fit.values, &all(&problem), &[]) {
            Ok(again) if again.outcome == fit.outcome => fit = Fit { iterations: fit.iterations + again.iterations, ..again },
            _ => {
                problem = problem.at_unit_variance(before);
                break;
            }
        }
    }
    (problem, fit)
}

/// Variance of unit weight of the residuals beside what the plausible sizes take up; `None` if there are none, or if they could take
/// up most of it.
fn left_variance(problem: &Problem, fit: &Fit) -> Option<f64> {
    let parameters = problem.parameters();
    let unit = fit.chi2 / fit.dof as f64;
    let (mut squares, mut numbers, mut held) = (fit.chi2, 0.0, false);
    for (k, &p) in fit.kept.iter().enumerate() {
        if let Prior::Plausible(_) = parameters[p].knowledge {
            held = true;
            squares -= problem.information(p) * fit.values[p].powi(2);
            // The share of a parameter that the samples determine (MacKay).
            numbers += (1.0 - problem.information(p) * fit.covariance[(k, k)] / unit).clamp(0.0, 1.0);
        }
    }
    let dof = fit.dof as f64 - numbers;
    (held && dof > LEAST_FREE * fit.dof as f64).then(|| (squares / dof).max(FINEST))
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
