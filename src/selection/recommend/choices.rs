//! The models to choose from, judged on the same postures, and the recommended one.

use std::ops::Range;

use super::curves;
use super::linear::{self, Linear};
use super::rule::Gain;
use crate::diagnosis::Examination;
use crate::diagnosis::folds::{Folds, postures};
use crate::diagnosis::library::Candidate;
use crate::effects;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::measure::poses::Postures;

/// The whole library is offered if its effective number of parameters is not larger than this share of three components
/// per posture.
const SHARE_OF_NUMBERS: f64 = 0.9;

/// Kind of model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The first model.
    Begin,
    /// The first model with the effects of the ladder's steps.
    Steps,
    /// The first model with the error curves of all joints.
    Curves,
    /// The first model with both.
    StepsAndCurves,
    /// The first model with the whole library, each effect regularised by the size estimated from the data.
    Library,
}

impl Kind {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Begin => "begin",
            Kind::Steps => "steps",
            Kind::Curves => "curves",
            Kind::StepsAndCurves => "steps_and_curves",
            Kind::Library => "whole_library",
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
    pub added: Vec<String>,
    /// Gain over the first model at postures that were not fitted, one entry per division; for the first model itself,
    /// its own errors.
    pub gains: Vec<Gain>,
}

impl Choice {
    /// True if it is better than the first model in every division, or is that model itself.
    pub fn convinces(&self) -> bool {
        self.kind == Kind::Begin || !self.gains.is_empty() && self.gains.iter().all(Gain::convinces)
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

/// Candidates by index, each with its prior information.
type Held = Vec<(usize, f64)>;

/// Judges the model of an examination: alone, with `steps`, with the error curves, and with `library` (ids with their prior
/// widths, in plausible sizes and units of the noise that remains with the library). Of the steps, `bad` exclude suspect
/// samples, without which all others are known better; they are excluded whichever model is chosen.
///
/// # Errors
/// When an effect does not fit the data, or a matrix cannot be factored.
pub fn recommend(
    datasets: &[NamedDataset<'_>],
    examination: &Examination,
    [steps, bad]: [&[String]; 2],
    library: &[(String, f64)],
) -> Result<Recommendation, IdentifyError> {
    let begin = examination.model();
    let divisions = postures(&examination.contexts);
    let postures = divisions.count();
    let plain: Vec<&String> = steps.iter().filter(|id| effects::catalogue::set_aside_by(id).is_none()).collect();
    let candidates = Candidates::new(examination, postures, &plain, library);
    let wide = examination.beside(datasets, candidates.all.clone())?;
    let mut linear = Linear::new(&wide, datasets);
    for (sample, id) in examination.problem().sample_ids().iter().enumerate() {
        linear.aside[sample] = steps.contains(&effects::catalogue::setting_aside(id));
    }

    let judged_elsewhere = stands_somewhere(examination) || Folds::of_places(&divisions, &linear.places).is_some();
    let most = judged_elsewhere.then_some(SHARE_OF_NUMBERS * 3.0 * postures as f64);
    let held = candidates.offered(&wide, &linear, most)?;
    let gains = gains(&divisions, &wide, &linear, &held)?;
    let sample_ids = examination.problem().sample_ids();
    let aside: Vec<String> = sample_ids.iter().zip(&linear.aside).filter(|(_, a)| **a).map(|(id, _)| id.clone()).collect();
    let choice = |((kind, held), gains): ((Kind, Held), Vec<Gain>)| {
        let mut model = begin.clone();
        let mut added = Vec::new();
        for id in
            aside.iter().map(|id| effects::catalogue::setting_aside(id)).filter(|id| kind != Kind::Begin || bad.contains(id))
        {
            model = model.with(&id);
        }
        for (place, information) in held {
            let id = &candidates.all[place].id;
            model = model.with(id);
            let is_ordinary = begin.is_unregularised(id) || plain.iter().any(|p| id == *p) && kind != Kind::Library;
            if !is_ordinary {
                model.width.insert(id.to_string(), information.sqrt().recip());
            }
            added.push(id.to_string());
        }
        Choice { kind, model, added, gains }
    };
    let choices: Vec<Choice> = held.into_iter().zip(gains).map(choice).collect();
    let mut all = Recommendation { choices, chosen: 0, aside, postures };
    all.chosen = all.ranked().first().copied().unwrap_or(0);
    Ok(all)
}

/// The candidates of all choices without repetition, and the indices of those in each group.
struct Candidates {
    all: Vec<Candidate>,
    steps: Held,
    library: Held,
    bands: Range<usize>,
}

impl Candidates {
    fn new(examination: &Examination, postures: usize, steps: &[&String], library: &[(String, f64)]) -> Self {
        let begin = examination.model();
        let bands = curves::bands(examination.problem().robot(), postures);
        // Bands come first: an effect of a step or of the library may be one of them, and their indices must stay one
        // range.
        let ids = bands.iter().chain(steps.iter().copied()).chain(library.iter().map(|(id, _)| id));
        let mut all: Vec<Candidate> = Vec::new();
        for id in ids {
            if !all.iter().any(|c| c.id == *id) {
                all.push(Candidate::new(id.clone()));
            }
        }
        let place = |id: &str| all.iter().position(|c| c.id == id).unwrap_or_default();
        let held = |id: &str, width: f64| (place(id), width.powi(-2));
        Candidates {
            steps: steps.iter().map(|id| held(id, begin.width_of(id))).collect(),
            library: library.iter().map(|(id, width)| held(id, width * examination.noise_scale.weight())).collect(),
            bands: 0..bands.len(),
            all,
        }
    }

    /// Returns the choices to judge, the first model first; the library only if its effective number of parameters is
    /// at most `most`.
    fn offered(&self, wide: &Examination, linear: &Linear<'_>, most: Option<f64>) -> Result<Vec<(Kind, Held)>, IdentifyError> {
        let all = linear.all_products();
        let curves_held = curves::held(wide, linear, &all, self.bands.clone(), &[])?;
        let mut held = vec![(Kind::Begin, Vec::new()), (Kind::Curves, curves_held)];
        if !self.steps.is_empty() {
            let with_steps = curves::held(wide, linear, &all, self.bands.clone(), &self.steps)?;
            held.push((Kind::Steps, self.steps.clone()));
            held.push((Kind::StepsAndCurves, self.steps.iter().copied().chain(with_steps).collect()));
        }
        if !self.library.is_empty()
            && let Some(most) = most
            && linear.effective(&all, &linear.with(self.library.iter().copied()))? <= most
        {
            held.push((Kind::Library, self.library.clone()));
        }
        Ok(held)
    }
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
