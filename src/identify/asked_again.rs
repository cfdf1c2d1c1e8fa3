//! What a fit leaves at nominal for its plausible size is asked again where the residuals say that it is larger.
//!
//! An arm whose zeros were lost by degrees leaves residuals of millimetres. Held against those, or against the plausible size
//! of a zero, its zeros are not worth estimating; yet together they explain all of the residuals.

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::Adjustment;
use super::determined::{Determined, determined};
use super::fit_result::{FitError, Outcome};
use super::problem::{Prior, Problem};
use crate::math::linalg;

/// Probability at which a fit to which nothing is missing is asked again (F test).
const BY_CHANCE: f64 = 1e-4;

/// All parameters together must leave at most this share of the variance of the residuals: smaller gains are those of errors
/// that no parameter describes, spread over all of them.
const SHARE: f64 = 0.5;

/// The noise against which parameters are held falls by this factor from one trial to the next.
const FINER: f64 = 0.316;

/// Largest number of trials: the noise falls by five orders.
const MOST_TRIALS: usize = 10;

/// Chi-square and its degrees of freedom.
#[derive(Clone, Copy)]
struct Left {
    chi2: f64,
    dof: f64,
}

impl Left {
    fn by(adjustment: &Adjustment) -> Self {
        Left { chi2: adjustment.chi2(), dof: adjustment.dof() as f64 }
    }

    fn variance(self) -> f64 {
        self.chi2 / self.dof
    }

    /// True if a fit with more parameters leaves so much less that chance does not explain it.
    fn is_above(self, wider: Left) -> bool {
        let added = self.dof - wider.dof;
        if added < 0.5 || wider.dof < 0.5 || self.chi2 <= wider.chi2 {
            return false;
        }
        let ratio = (self.chi2 - wider.chi2) / added / wider.variance();
        FisherSnedecor::new(added, wider.dof).is_ok_and(|f| f.sf(ratio) < BY_CHANCE)
    }
}

/// The adjustment with the fewest parameters that leaves no more than all that are independent would, if that is far less than
/// it leaves itself; otherwise the adjustment as it is. The parameters are judged at `at`, and those that are not fitted keep
/// their values of `judged` (deviations, SI).
///
/// # Errors
/// When a value is not finite.
pub(super) fn asked_again(
    problem: &Problem,
    judged: &[f64],
    at: &[f64],
    free: &[usize],
    adjustment: Adjustment,
) -> Result<(Adjustment, usize), FitError> {
    let own = Left::by(&adjustment);
    // What the stated noise explains lacks nothing.
    if own.dof < 1.0 || problem.noise_stated() && own.variance() <= 1.0 {
        return Ok((adjustment, 0));
    }
    let all = match determined(problem, at, free, 0.0) {
        Ok(all) if all.kept != adjustment.kept() => all,
        Ok(_) | Err(FitError::TooFewRows { .. }) => return Ok((adjustment, 0)),
        Err(e) => return Err(e),
    };
    let bound = within_reach(problem, adjustment.values(), &all);
    if bound.variance() > SHARE * own.variance() || !own.is_above(bound) {
        return Ok((adjustment, 0));
    }
    let mut noise = problem.noise_at(adjustment.values());
    let (mut best, mut iterations) = (adjustment, 0);
    for _ in 0..MOST_TRIALS {
        let is_enough = !Left::by(&best).is_above(bound);
        // A noise that is not stated is that of the residuals, which the parameters found have lowered.
        let residual = Left::by(&best).variance().sqrt();
        if is_enough && (problem.noise_stated() || noise <= residual) {
            break;
        }
        noise = if is_enough { residual.max(FINER * noise) } else { FINER * noise };
        let chosen = determined(problem, at, free, noise)?;
        if chosen.kept == best.kept() {
            continue;
        }
        // What was fitted before and no longer is goes back: an estimate is all that a calibration keeps of it.
        let mut start = judged.to_vec();
        chosen.kept.iter().for_each(|&p| start[p] = best.values()[p]);
        match fitted(problem, chosen, &start) {
            Some(wider) if wider.chi2() < best.chi2() => {
                iterations += wider.iterations();
                best = wider;
            }
            // What leads to no arm was rightly left out, and so was all that is fainter.
            _ => break,
        }
    }
    Ok((best, iterations))
}

/// The fit of these parameters from `start`; `None` if it ends at no arm. Touches of one pin are explained best by an arm without
/// any length.
fn fitted(problem: &Problem, chosen: Determined, start: &[f64]) -> Option<Adjustment> {
    let mut wider = Adjustment::of(problem, chosen);
    wider.adjust(problem, start).ok()?;
    wider.confirm(problem, start).ok()?;
    let is_arm = wider.outcome() == Outcome::Converged && problem.left_linear_range(wider.values()).is_none();
    is_arm.then_some(wider)
}

/// What one linear step from `values` would leave with all these parameters.
fn within_reach(problem: &Problem, values: &[f64], all: &Determined) -> Left {
    let rows = problem.whitened(values, &all.kept);
    let known = |p: usize| problem.information(p);
    let priors: Vec<(usize, usize)> = all.kept.iter().copied().enumerate().filter(|&(_, p)| known(p) > 0.0).collect();
    let (m, n) = (all.kept.len(), rows.ncols());
    let mut tall = DMatrix::zeros(n + priors.len(), m + 1);
    tall.rows_mut(0, n).copy_from(&rows.transpose());
    for (k, &(column, p)) in priors.iter().enumerate() {
        let weight = known(p).sqrt();
        tall[(n + k, column)] = weight;
        tall[(n + k, m)] = -weight * values[p];
    }
    for mut column in tall.columns_mut(0, m).column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    let triangle = linalg::triangle(tall);
    let chi2 = if triangle.nrows() > m { triangle[(m, m)].powi(2) } else { 0.0 };
    let flat = all.kept.iter().filter(|&&p| problem.parameters()[p].knowledge == Prior::Uninformative).count();
    let dof = (problem.row_count() - flat).saturating_sub(problem.prior_count()) as f64;
    Left { chi2, dof }
}
