//! The hypotheses that are examined closely.

use super::Examination;
use super::evidence::ln_sum_exp;
use super::findings::{Freely, findings};
use super::hypotheses::Hypothesis;
use super::library::Candidate;
use crate::effects::EffectId;
use crate::effects::facts::Role;
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::FitError;
use crate::measure::dataset::NamedDataset;

/// Chance of an effect of implausible size below which it is told.
const SURE: f64 = 1e-3;

/// Probability of the credible set.
const CREDIBLE: f64 = 0.95;

/// A user-defined effect is implausible beyond this many plausible sizes.
const BELIEVABLE: f64 = 30.0;

/// An effect with a prior is implausible beyond this many plausible sizes.
const MOST_SIZES: f64 = 50.0;

/// Number of hypotheses examined closely: this many, or up to twice as many if the credible set is larger, by evidence
/// against the background, and this many of the others by evidence against noise alone.
const SHORTLIST: usize = 8;

/// True if the data allow a candidate to lie in the linear range of its family and within [`MOST_SIZES`]; for a user-defined
/// effect, within [`BELIEVABLE`].
fn is_believable(close: &Examination, candidate: usize, effect: &str) -> Result<bool, FitError> {
    let freely = Freely::of(close, candidate)?;
    let Some(family) = close.model.family(effect) else { return Ok(freely.least_size() <= BELIEVABLE) };
    if family.role != Role::Baseline && freely.least_size() > MOST_SIZES {
        return Ok(false);
    }
    Ok(close.spans[candidate].range().enumerate().all(|(i, column)| {
        let column = &close.columns[column];
        let spec = &close.wide.parameters()[column.parameter].spec;
        family.linear_range.holds(spec, freely.least[i] * column.plausible)
    }))
}

/// True if the data allow the values of a candidate to be physically possible: a compliance above zero, say.
fn is_possible(datasets: &[NamedDataset<'_>], close: &Examination, candidate: usize, effect: &str) -> Result<bool, FitError> {
    let Some(family) = close.model.family(effect) else { return Ok(true) };
    // What belongs to every model is added with all its members, and a member that comes out wrong is told as a symptom.
    if family.role == Role::Baseline {
        return Ok(true);
    }
    let heaviest = datasets.iter().flat_map(|d| d.dataset.payloads.iter().map(|p| p.mass)).fold(0.0, f64::max);
    let freely = Freely::of(close, candidate)?;
    Ok(close.spans[candidate].range().enumerate().all(|(i, column)| {
        let column = &close.columns[column];
        let spec = &close.wide.parameters()[column.parameter].spec;
        family.physical.violated(spec.nominal + freely.nearest(i) * column.plausible, 0.0, heaviest).is_none()
    }))
}

/// Hypotheses examined closely, as the candidates of an examination.
pub(super) struct Shortlist {
    pub close: Examination,
    pub hypotheses: Vec<Hypothesis>,
    pub believable: Vec<bool>,
    /// True if no physical limit is violated.
    possible: Vec<bool>,
}

impl Shortlist {
    /// Selects from `all`, which is sorted with the most credible first.
    pub fn of(datasets: &[NamedDataset<'_>], examination: &Examination, all: &[Hypothesis]) -> Result<Self, IdentifyError> {
        let set = credible(all).clamp(SHORTLIST, 2 * SHORTLIST).min(all.len());
        let mut places: Vec<usize> = (0..set).collect();
        let mut plain: Vec<usize> = (0..all.len()).collect();
        plain.sort_by(|&a, &b| all[b].ln_evidence.total_cmp(&all[a].ln_evidence).then(a.cmp(&b)));
        places.extend(plain.into_iter().filter(|k| *k >= set).take(SHORTLIST));
        let hypotheses: Vec<Hypothesis> = places.into_iter().map(|k| all[k].clone()).collect();
        let candidates = hypotheses.iter().map(|h| Candidate::new(h.in_model.clone()));
        let close = examination.beside(datasets, candidates.collect())?;
        let is_sample = |h: &Hypothesis| h.effect.family() == EffectId::OUTLIER;
        let can_be = |(k, h): (usize, &Hypothesis)| Ok(is_sample(h) || is_possible(datasets, &close, k, &h.effect)?);
        let possible = hypotheses.iter().enumerate().map(can_be).collect::<Result<Vec<bool>, FitError>>()?;
        let is_one = |(k, h): (usize, &Hypothesis)| Ok(possible[k] && (is_sample(h) || is_believable(&close, k, &h.effect)?));
        let believable = hypotheses.iter().enumerate().map(is_one).collect::<Result<_, FitError>>()?;
        Ok(Shortlist { close, hypotheses, believable, possible })
    }

    /// The hypothesis with this id, either in a model or in the catalogue.
    pub fn named(&self, effect: &str) -> Option<&Hypothesis> {
        self.hypotheses.iter().find(|h| h.in_model == effect || h.effect == effect)
    }

    /// Hypotheses of implausible size or impossible sign, with their indices.
    pub fn unbelievable(&self) -> impl Iterator<Item = (usize, &Hypothesis)> {
        self.hypotheses.iter().enumerate().filter(|(k, _)| !self.believable[*k])
    }

    /// Those of impossible sign.
    pub fn impossible(&self) -> impl Iterator<Item = &Hypothesis> {
        self.unbelievable().filter(|(k, _)| !self.possible[*k]).map(|(_, h)| h)
    }

    /// Those of implausible size alone.
    pub fn too_large(&self) -> impl Iterator<Item = &Hypothesis> {
        self.unbelievable().filter(|(k, _)| self.possible[*k]).map(|(_, h)| h)
    }

    /// Ids and sizes of those of implausible size that are significant: an effect that the data hardly show may come
    /// out at any size.
    pub fn surely_unbelievable(&self, datasets: &[NamedDataset<'_>], tests: usize) -> Result<Vec<(EffectId, f64)>, FitError> {
        let surely = findings(datasets, &self.close, &self.hypotheses, tests, |_| 0.0)?;
        let is_sure = |h: &Hypothesis| surely.iter().any(|f| f.hypothesis.in_model == h.in_model && f.p_family < SURE);
        let told = self.unbelievable().filter(|(k, h)| self.possible[*k] && is_sure(h));
        told.map(|(k, h)| Ok((h.in_model.clone(), Freely::of(&self.close, k)?.size()))).collect()
    }
}

/// Number of hypotheses in the credible set; `all` is sorted with the most credible first.
pub(super) fn credible(all: &[Hypothesis]) -> usize {
    let ln_all = ln_sum_exp(all.iter().map(|h| h.ln_evidence_against_background));
    let (mut set, mut mass) = (0, 0.0);
    while mass < CREDIBLE && set < all.len() {
        mass += (all[set].ln_evidence_against_background - ln_all).exp();
        set += 1;
    }
    set
}
