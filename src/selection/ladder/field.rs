//! The field of joint errors as a choice of a ladder: what no named set of effects explains.

use super::READILY;
use super::step::{LadderStep, examined_with_field};
use crate::diagnosis::Examination;
use crate::diagnosis::folds::{Folds, places_of_balls, postures};
use crate::effects::EffectId;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::{Measured, NamedDataset, Sample};
use crate::prediction::field::HeldField;
use crate::selection::Objection;
use crate::selection::hold_out::HoldOut;
use crate::selection::recommend::{Choice, ChoiceKind, FieldChoice, Gain};

/// The field beyond a judged model, with that model fitted where its gate is open, no left-out campaign objects, and left-out blocks
/// are predicted better; `None` if the residual is noise or the data carry no field.
///
/// Shapes that the ladder has added describe as a field does: it takes their place. `begin` is the first model.
///
/// # Errors
/// When a matrix cannot be factored.
pub(super) fn beyond(
    datasets: &[NamedDataset<'_>],
    begin: &Model,
    below: &LadderStep,
    ground: HoldOut<'_>,
) -> Result<Option<(Choice, Option<LadderStep>)>, IdentifyError> {
    // Nothing is added to a residual that is as small as its noise, where that is known.
    if (below.diagnosis.verdict.is_noise() && below.diagnosis.lack_of_fit_p.is_some())
        || below.calibration.unconverged().is_some()
        || below.model.lists(EffectId::ERROR_FIELD)
    {
        return Ok(None);
    }
    if knows_places_alone(datasets) {
        return Ok(None);
    }
    let is_shape = |own: &str| !begin.own.iter().any(|o| o.name == own);
    let mut named = below.model.clone();
    for own in below.model.own.iter().filter(|own| is_shape(&own.name)) {
        named = named.without(&own.name);
    }
    named.own.retain(|own| !is_shape(&own.name));
    let Ok(held) = HeldField::of(datasets, &named) else { return Ok(None) };
    let Ok(worth) = held.worth(datasets, &ground.poses.q) else { return Ok(None) };
    let model = held.model(datasets);
    let added: Vec<EffectId> = model.effects.iter().filter(|id| !named.lists(id)).cloned().collect();
    let gains = gains(datasets, &held);
    let is_open = worth.gate.is_open();
    let expected = [&worth.before, &worth.after].map(|expected| expected.level());
    let field = FieldChoice { gate: worth.gate, shares: worth.shares, expected };
    let choice = Choice { kind: ChoiceKind::Field, model, added, gains, field: Some(field) };
    if !is_open {
        return Ok(Some((choice, None)));
    }
    let Some(examination) = Examination::within_steps(datasets, &choice.model, READILY)? else {
        return Ok(Some((choice, None)));
    };
    let step = examined_with_field(datasets, &choice.model, &examination, Some(&held), ground)?;
    let step = LadderStep { added: choice.added.clone(), gains: choice.gains.clone(), ..step };
    let is_taken =
        step.cross_validated < below.cross_validated && !step.objections(below).iter().any(Objection::is_measured_elsewhere);
    Ok(Some((choice, is_taken.then_some(step))))
}

/// True if nothing but balls was measured: such a campaign knows a few places, and no division of it is as far from them as the
/// robot's work.
pub(super) fn knows_places_alone(datasets: &[NamedDataset<'_>]) -> bool {
    let is_at_a_ball = |s: &Sample| matches!(s.measured, Measured::Ball { .. });
    datasets.iter().all(|d| d.dataset.samples.iter().all(is_at_a_ball))
}

/// Gain of the field at left-out postures, one entry per division.
fn gains(datasets: &[NamedDataset<'_>], held: &HeldField) -> Vec<Gain> {
    let examination = held.base();
    let contexts = &examination.contexts;
    let divided = postures(contexts);
    let of_posture = divided.of_samples();
    let means = |squares: &[Option<f64>]| {
        let mut sums = vec![(0.0, 0.0); divided.count()];
        for (&posture, square) in of_posture.iter().zip(squares) {
            if let Some(square) = square {
                sums[posture] = (sums[posture].0 + square, sums[posture].1 + 1.0);
            }
        }
        sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect::<Vec<Option<f64>>>()
    };
    let of = |folds: Folds| {
        let of_samples: Vec<usize> = of_posture.iter().map(|&p| folds.of[p]).collect();
        let [before, after] = held.squares(&of_samples).map(|squares| means(&squares));
        Gain::of(folds.division, &before, &after)
    };
    Folds::all(&divided, contexts, &places_of_balls(examination, datasets)).into_iter().filter_map(of).collect()
}
