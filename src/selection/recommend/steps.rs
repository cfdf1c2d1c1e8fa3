//! Gain of single steps: the effects that one model has in addition to another, judged at left-out postures.

use super::linear::Linear;
use super::rule::Gain;
use crate::diagnosis::Examination;
use crate::diagnosis::additions::Addition;
use crate::diagnosis::folds::{Folds, postures};
use crate::diagnosis::library::Candidate;
use crate::effects::{self, EffectId};
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;

/// Computes the gain of `after` over `before`, one entry per division; empty if it adds nothing but excluded samples.
///
/// # Errors
/// When an effect does not fit the data, or a matrix cannot be factored.
pub fn gains(datasets: &[NamedDataset<'_>], before: &Model, after: &Model) -> Result<Vec<Gain>, IdentifyError> {
    let is_new = |id: &&EffectId| !before.lists(id) && effects::catalogue::set_aside_by(id).is_none();
    let added: Vec<&str> = after.effects.iter().filter(is_new).map(EffectId::whole).collect();
    if added.is_empty() {
        return Ok(Vec::new());
    }
    let mut aside: Vec<&str> = after.effects.iter().filter_map(|id| effects::catalogue::set_aside_by(id)).collect();
    aside.dedup();
    let before = Model { own: after.own.clone(), ..before.clone() };
    let widths = Model { width: after.width.clone(), ..before.clone() };
    Ok(judged(datasets, &before, &widths, &[added], &aside)?.pop().unwrap_or_default())
}

/// Computes the gain of each of these additions alone in addition to a model.
///
/// # Errors
/// As [`gains`].
pub fn gains_of_each(
    datasets: &[NamedDataset<'_>],
    before: &Model,
    additions: &[Addition],
) -> Result<Vec<Vec<Gain>>, IdentifyError> {
    let is_aside = |a: &Addition| effects::catalogue::set_aside_by(&a.name).is_some();
    let alone: Vec<Vec<&str>> = additions.iter().map(|a| if is_aside(a) { Vec::new() } else { vec![a.name.whole()] }).collect();
    let known = additions.iter().fold(before.clone(), |model, addition| addition.known_to(&model));
    judged(datasets, &known, &known, &alone, &[])
}

fn judged(
    datasets: &[NamedDataset<'_>],
    before: &Model,
    widths: &Model,
    sets: &[Vec<&str>],
    aside: &[&str],
) -> Result<Vec<Vec<Gain>>, IdentifyError> {
    let mut ids: Vec<&str> = sets.iter().flatten().copied().collect();
    ids.sort_unstable();
    ids.dedup();
    let candidates = ids.iter().map(|id| Candidate::new(*id)).collect();
    let wide = Examination::with(datasets, before, candidates)?;
    let mut linear = Linear::new(&wide, datasets);
    for (sample, id) in wide.problem().sample_ids().iter().enumerate() {
        linear.aside[sample] = aside.contains(&id.as_str());
    }
    let place = |id: &str| ids.iter().position(|i| *i == id).unwrap_or_default();
    let variants: Vec<_> =
        sets.iter().map(|set| linear.with(set.iter().map(|id| (place(id), widths.width_of(id).powi(-2))))).collect();
    let base = linear.base();
    let mut all = vec![Vec::new(); sets.len()];
    for folds in Folds::all(&postures(&wide.contexts), &wide.contexts, &linear.places) {
        let division = folds.division;
        let products = linear.fold_products(folds);
        let before = linear.held_out(&products, &base)?;
        for ((variant, set), gains) in variants.iter().zip(sets).zip(&mut all) {
            if !set.is_empty() {
                gains.extend(Gain::of(division, &before, &linear.held_out(&products, variant)?));
            }
        }
    }
    Ok(all)
}
