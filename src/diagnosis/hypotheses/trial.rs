//! Trials of a family at many places.

use super::hypothesis::{Hypothesis, Place};
use crate::diagnosis::Examination;
use crate::diagnosis::background::Background;
use crate::diagnosis::evidence::{SIZES, Seen, ln_mean_exp};
use crate::diagnosis::sweep;
use crate::effects::{self, EffectId};

/// A family tried at many places: its evidence is the mean over them, its place the one with the highest evidence.
pub(super) struct Tried {
    places: Vec<TriedPlace>,
    plain: Vec<f64>,
    aware: Vec<f64>,
    explained: Vec<(f64, usize)>,
    visible: Vec<f64>,
}

/// A place at which a family is tried.
#[derive(Clone)]
pub(super) struct TriedPlace {
    /// The place; `None` if the id says all of it.
    pub place: Option<Place>,
    /// Id of the effect there in a model.
    pub in_model: EffectId,
}

/// Result at one place.
pub(super) struct Trial {
    pub place: TriedPlace,
    pub ln_evidence: [f64; 2],
    pub explained: (f64, usize),
    pub visible: f64,
}

impl Trial {
    pub fn new(examination: &Examination, background: &Background, place: TriedPlace, block: &sweep::Block) -> Self {
        Trial {
            place,
            ln_evidence: block.ln_evidence(examination, background, &SIZES),
            explained: Seen::new(block.k.clone(), &block.z).explained(),
            visible: if block.whole > 0.0 { (block.k.trace() / block.whole).clamp(0.0, 1.0) } else { 0.0 },
        }
    }
}

impl Tried {
    pub fn of(trials: Vec<Trial>) -> Self {
        Tried {
            plain: trials.iter().map(|t| t.ln_evidence[0]).collect(),
            aware: trials.iter().map(|t| t.ln_evidence[1]).collect(),
            explained: trials.iter().map(|t| t.explained).collect(),
            visible: trials.iter().map(|t| t.visible).collect(),
            places: trials.into_iter().map(|t| t.place).collect(),
        }
    }

    /// The hypothesis at its best place; `effect` derives its id from the id in a model.
    pub fn hypothesis(self, examination: &Examination, effect: impl Fn(&EffectId) -> EffectId) -> Option<Hypothesis> {
        let best = (0..self.places.len()).max_by(|&a, &b| self.aware[a].total_cmp(&self.aware[b]))?;
        let TriedPlace { place, in_model } = self.places[best].clone();
        Some(Hypothesis {
            effect: effect(&in_model),
            in_model,
            place,
            ln_evidence: ln_mean_exp(&self.plain),
            ln_evidence_against_background: ln_mean_exp(&self.aware),
            explains: self.explained[best].0 / examination.remainder.squares,
            coefficients: self.explained[best].1,
            visible: self.visible[best],
            places: self.places.len(),
            moment: None,
        })
    }
}

/// Plausible size of the first parameter of an effect.
pub(super) fn plausible(examination: &Examination, id: &str) -> Option<f64> {
    let subject = examination.model.subject(examination.problem.robot(), &examination.library.balls);
    effects::build(id, &subject).ok()?.parameters().first().map(|p| p.prior)
}
