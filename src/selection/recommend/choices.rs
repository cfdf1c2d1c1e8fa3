//! The models to choose from, judged on the same postures, and the recommended one.

use super::linear::{self, Linear};
use super::rule::Gain;
use crate::diagnosis::Examination;
use crate::diagnosis::folds::{Folds, postures};
use crate::diagnosis::library::Candidate;
use crate::effects::{self, EffectId};
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::measure::poses::Postures;
use crate::prediction::field::{FieldShare, Gate};

/// Kind of model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The first model.
    Begin,
    /// The first model with the effects of the ladder's steps.
    Steps,
    /// The first model with the whole library, each effect regularised by the size estimated from the data: of a campaign of balls
    /// alone, which carries no field.
    Library,
    /// The model of the last step, or the first, with the field of joint errors.
    Field,
}

impl Kind {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Begin => "begin",
            Kind::Steps => "steps",
            Kind::Library => "whole_library",
            Kind::Field => "error_field",
        }
    }
}

/// A model to choose from.
#[derive(Debug, Clone)]
pub struct Choice {
    /// Kind of the model.
    pub kind: Kind,
    /// The model.
    pub model: Model,
    /// Effects added to the first model.
    pub added: Vec<EffectId>,
    /// Gain over the first model at postures that were not fitted, one entry per division; for the first model itself,
    /// its own errors.
    pub gains: Vec<Gain>,
    /// What is known of its field of joint errors; `None` for other models.
    pub field: Option<FieldChoice>,
}

/// A field of joint errors at the poses where the robot is to work.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldChoice {
    /// The conditions under which it is used.
    pub gate: Gate,
    /// Shares of its correction, the largest first.
    pub shares: Vec<FieldShare>,
    /// Mean error to expect without it and with it, noise of the instrument included, m.
    pub expected: [f64; 2],
}

impl Choice {
    /// True if it is better than the first model in every division, or is that model itself; a field of joint errors, if its
    /// gate is open.
    pub fn convinces(&self) -> bool {
        match (&self.field, self.kind) {
            (Some(field), _) => field.gate.is_open(),
            (None, Kind::Begin) => true,
            (None, _) => !self.gains.is_empty() && self.gains.iter().all(Gain::convinces),
        }
    }

    /// Share of the mean square that remains, averaged over the divisions.
    pub fn left(&self) -> f64 {
        1.0 - self.gains.iter().map(|g| g.share).sum::<f64>() / self.gains.len().max(1) as f64
    }

    /// Root mean square of the error at left-out postures chosen at random, m; `None` with too few postures.
    pub fn cross_validated(&self) -> Option<f64> {
        self.gains.first().map(|g| g.rms[1])
    }
}

/// Recommendation of a model.
#[derive(Debug, Clone)]
pub struct Recommendation {
    /// All models that were judged; the first entry is the first model.
    pub choices: Vec<Choice>,
    /// Index of the recommended one.
    pub chosen: usize,
    /// Samples that the steps exclude; every model but the first excludes them too.
    pub aside: Vec<String>,
    /// Number of postures.
    pub postures: usize,
}

impl Recommendation {
    /// Indices of the choices that convince, best first; the first model is always among them.
    pub fn ranked(&self) -> Vec<usize> {
        let mut places: Vec<usize> = (0..self.choices.len()).filter(|&k| self.choices[k].convinces()).collect();
        places.sort_by(|&a, &b| self.choices[a].left().total_cmp(&self.choices[b].left()));
        places
    }

    /// The choice of a kind; `None` if it was not offered.
    pub fn of_kind(&self, kind: Kind) -> Option<&Choice> {
        self.choices.iter().find(|c| c.kind == kind)
    }

    /// The recommended choice.
    pub fn choice(&self) -> &Choice {
        &self.choices[self.chosen]
    }
}

/// The library is offered if its effective number of parameters is not larger than this share of three components per posture:
/// of more, no posture would be left to judge it by.
const SHARE_OF_NUMBERS: f64 = 0.9;

/// An effect with the width that the data give it.
#[derive(Debug, Clone, PartialEq)]
pub struct SizedCandidate {
    /// The effect.
    pub effect: EffectId,
    /// Its one-sigma before the data, in plausible sizes.
    pub width: f64,
}

/// Candidates by index, each with its prior information.
type Held = Vec<(usize, f64)>;

/// Judges the model of an examination: alone, with `steps`, and with `library` (ids with their prior widths, in plausible sizes and
/// units of the noise that remains with the library). Of the steps, `bad` exclude suspect samples, without which all others are
/// known better; they are excluded whichever model is chosen.
///
/// # Errors
/// When an effect does not fit the data, or a matrix cannot be factored.
pub fn recommend(
    datasets: &[NamedDataset<'_>],
    examination: &Examination,
    [steps, bad]: [&[EffectId]; 2],
    library: &[SizedCandidate],
) -> Result<Recommendation, IdentifyError> {
    let begin = examination.model();
    let divisions = postures(&examination.contexts);
    let postures = divisions.count();
    let plain: Vec<&EffectId> = steps.iter().filter(|id| effects::catalogue::set_aside_by(id).is_none()).collect();
    let mut candidates: Vec<Candidate> = plain.iter().map(|id| Candidate::new((*id).clone())).collect();
    let beside = library.iter().filter(|sized| !plain.contains(&&sized.effect));
    candidates.extend(beside.map(|sized| Candidate::new(sized.effect.clone())));
    let wide = examination.beside(datasets, candidates.clone())?;
    let mut linear = Linear::new(&wide, datasets);
    for (sample, id) in examination.problem().sample_ids().iter().enumerate() {
        linear.aside[sample] = steps.contains(&effects::catalogue::setting_aside(id).into());
    }

    let mut held = vec![(Kind::Begin, Vec::new())];
    if !plain.is_empty() {
        held.push((Kind::Steps, plain.iter().enumerate().map(|(k, id)| (k, begin.width_of(id).powi(-2))).collect()));
    }
    let judged_elsewhere = stands_somewhere(examination) || Folds::of_places(&divisions, &linear.places).is_some();
    if !library.is_empty() && judged_elsewhere {
        let place = |id: &EffectId| candidates.iter().position(|c| c.id == *id).unwrap_or_default();
        let information = |width: f64| (width * examination.noise_scale.weight()).powi(-2);
        let whole: Held = library.iter().map(|sized| (place(&sized.effect), information(sized.width))).collect();
        let numbers = linear.effective(&linear.all_products(), &linear.with(whole.iter().copied()))?;
        if numbers <= SHARE_OF_NUMBERS * 3.0 * postures as f64 {
            held.push((Kind::Library, whole));
        }
    }
    let gains = gains(&divisions, &wide, &linear, &held)?;
    let sample_ids = examination.problem().sample_ids();
    let aside: Vec<String> = sample_ids.iter().zip(&linear.aside).filter(|(_, a)| **a).map(|(id, _)| id.clone()).collect();
    let choice = |((kind, held), gains): ((Kind, Held), Vec<Gain>)| {
        let mut model = begin.clone();
        let mut added = Vec::new();
        for id in aside
            .iter()
            .map(|id| EffectId::from(effects::catalogue::setting_aside(id)))
            .filter(|id| kind != Kind::Begin || bad.contains(id))
        {
            model = model.with(&id);
        }
        for (place, information) in held {
            let id = &candidates[place].id;
            model = model.with(id);
            if kind == Kind::Library && !begin.is_unregularised(id) {
                model.width.insert(id.to_string(), information.sqrt().recip());
            }
            added.push(id.clone());
        }
        Choice { kind, model, added, gains, field: None }
    };
    let choices: Vec<Choice> = held.into_iter().zip(gains).map(choice).collect();
    let mut all = Recommendation { choices, chosen: 0, aside, postures };
    all.chosen = all.ranked().first().copied().unwrap_or(0);
    Ok(all)
}

/// Computes the gain of each choice over the first, one entry per division.
fn gains(
    divisions: &Postures,
    wide: &Examination,
    linear: &Linear<'_>,
    held: &[(Kind, Held)],
) -> Result<Vec<Vec<Gain>>, IdentifyError> {
    let variants: Vec<linear::Choice> = held.iter().map(|(_, held)| linear.with(held.iter().copied())).collect();
    let mut gains: Vec<Vec<Gain>> = vec![Vec::new(); held.len()];
    for folds in Folds::all(divisions, &wide.contexts, &linear.places) {
        let division = folds.division;
        let products = linear.fold_products(folds);
        let before = linear.held_out(&products, &variants[0])?;
        for (variant, gains) in variants.iter().zip(&mut gains) {
            gains.extend(Gain::of(division, &before, &linear.held_out(&products, variant)?));
        }
    }
    Ok(gains)
}

/// True if a position in the world is known. If none is, the behaviour of a hundred effects at a new place shows only
/// at left-out places.
fn stands_somewhere(examination: &Examination) -> bool {
    !examination.problem().parameters().iter().any(|p| p.defines_world)
}
