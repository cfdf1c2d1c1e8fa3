//! The next step: what the diagnosis proposes is tried in turn, and the first addition to which there is no objection is taken.

use super::RefusedStep;
use super::progress::{Interrupted, LadderProgress, Observer, report, unobserved};
use super::step::{LadderStep, add, readily_step};
use crate::diagnosis::additions::Addition;
use crate::diagnosis::{Diagnosis, Verdict};
use crate::effects;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::selection::Objection;
use crate::selection::hold_out::HoldOut;
use crate::selection::recommend::Gain;
use crate::selection::recommend::steps::gains_of_each;

/// Share of the squares at left-out postures by which a shape must gain more than an effect with a cause to be preferred.
const SHAPE_GAINS: f64 = 0.03;

/// The same where an effect with a cause is named for a part of the residual: the cause is what is sought, and the next step
/// may find the rest.
const SHAPE_BEFORE_NAMED: f64 = 0.2;

/// The next step, or those that were refused.
pub type Next = Result<Box<LadderStep>, Vec<RefusedStep>>;

/// Finds the step that a ladder takes after `below`.
///
/// # Errors
/// When the gain of the effects cannot be computed. A step that cannot be fitted is not taken.
pub fn best_step(datasets: &[NamedDataset<'_>], below: &LadderStep, ground: HoldOut<'_>) -> Result<Next, IdentifyError> {
    Ok(next_step(datasets, std::slice::from_ref(below), ground, &mut unobserved)?)
}

/// As [`best_step`], for the step after the last of `so_far`, and reports its progress. A step must not contradict the best of them.
///
/// # Errors
/// As [`best_step`], and if `observer` cancels.
pub(in crate::selection) fn next_step<B>(
    datasets: &[NamedDataset<'_>],
    so_far: &[LadderStep],
    ground: HoldOut<'_>,
    observer: &mut Observer<'_, B>,
) -> Result<Next, Interrupted<B>> {
    let Some(below) = so_far.last() else { return Ok(Err(Vec::new())) };
    let best = LadderStep::best_measured(so_far).unwrap_or(below);
    let mut tried = Vec::new();
    let suspects = below.diagnosis.without_suspects();
    if !suspects.is_empty() {
        // A bad sample may seem useful as long as another one remains, so all suspects are excluded together.
        report(observer, LadderProgress::Trying(&suspects))?;
        let objections = match add(datasets, below, &suspects, ground) {
            Ok(next) => {
                let mut objections = next.objections(below);
                objections.extend(next.objection_of_the_others(below));
                if !objections.iter().any(Objection::refuses) {
                    return Ok(Ok(Box::new(next)));
                }
                objections
            }
            Err(e) => vec![Objection::NotFitted { because: e.to_string() }],
        };
        let refused = RefusedStep { effects: suspects.clone(), objections };
        report(observer, LadderProgress::Refused(&refused))?;
        tried.push(refused);
    }
    let mut additions = below.diagnosis.additions();
    if below.diagnosis.shape().is_some() {
        // Samples in which a shape shows most are not bad samples: the shape is what is missing.
        additions.retain(|a| effects::catalogue::set_aside_by(&a.name).is_none() || suspects.contains(&a.name));
    }
    if below.would_miss(suspects.len()) {
        // If they are refused together, none of them is tried alone.
        additions.retain(|a| !suspects.contains(&a.name));
    }
    let gains = gains_of_each(datasets, &below.model, &additions)?;
    for k in order(&below.diagnosis, &additions, &gains) {
        let effect = [additions[k].name.clone()];
        report(observer, LadderProgress::Trying(&effect))?;
        let objections = match gains[k].iter().find(|gain| !gain.convinces()) {
            Some(gain) => vec![Objection::Gain(*gain)],
            None => match readily_step(datasets, below, &additions[k].added_to(&below.model), effect.to_vec(), ground) {
                Ok(next) => {
                    let mut objections = next.objections(below);
                    objections.extend(next.measured_worse_than(best).filter(|worse| !objections.contains(worse)));
                    if !objections.iter().any(Objection::refuses) {
                        return Ok(Ok(Box::new(next)));
                    }
                    objections
                }
                Err(e) => vec![Objection::NotFitted { because: e.to_string() }],
            },
        };
        let refused = RefusedStep { effects: effect.to_vec(), objections };
        report(observer, LadderProgress::Refused(&refused))?;
        tried.push(refused);
    }
    Ok(Err(tried))
}

/// The order in which additions are tried: if nothing is named, by their gains; otherwise as the diagnosis has them, but a shape
/// that gains clearly more than everything named comes first.
fn order(diagnosis: &Diagnosis, additions: &[Addition], gains: &[Vec<Gain>]) -> Vec<usize> {
    // Those with a cause are preferred to a shape that gains hardly more.
    let gained = |k: usize| {
        let handicap = if additions[k].is_shape() { SHAPE_GAINS } else { 0.0 };
        gains[k].iter().map(|g| g.share).sum::<f64>() / gains[k].len().max(1) as f64 - handicap
    };
    let mut order: Vec<usize> = (0..additions.len()).collect();
    match diagnosis.verdict {
        Verdict::Unexplained => order.sort_by(|&a, &b| gained(b).total_cmp(&gained(a))),
        Verdict::Partly => {
            let named = order.iter().filter(|&&k| !additions[k].is_shape()).map(|&k| gained(k)).fold(0.0, f64::max);
            order.sort_by_key(|&k| !(additions[k].is_shape() && gained(k) > named + SHAPE_BEFORE_NAMED));
        }
        _ => {}
    }
    order
}
