//! The models that a campaign offers, judged on the same postures, and the one to use.

use std::ops::Range;

use super::curves;
use super::folds::{Folds, postures};
use super::linear::{self, Linear};
use super::rule::Gain;
use crate::assess::examination::Examination;
use crate::assess::library::Candidate;
use crate::effects;
use crate::identify::{IdentifyError, Model};
use crate::measure::{Dataset, Postures};

/// The whole library is offered while its parameters in effect are no larger a share of three numbers a posture.
const SHARE_OF_NUMBERS: f64 = 0.9;

/// What kind of model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The model to begin with.
    Begin,
    /// With the effects of the ladder's steps.
    Steps,
    /// With the error curves of all joints.
    Curves,
    /// With both.
    StepsAndCurves,
    /// With the whole library, each effect held to the size that the data give it.
    Library,
}

impl Kind {
    /// As in files.
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

/// A model that may be used.
#[derive(Debug, Clone)]
pub struct Choice {
    /// What kind.
    pub kind: Kind,
    /// The model.
    pub model: Model,
    /// What it adds to the model to begin with.
    pub added: Vec<String>,
    /// What it gains over the model to begin with at postures that were not fitted, one entry a division; for that model itself, its own
    /// errors.
    pub gains: Vec<Gain>,
}

impl Choice {
    /// Whether every division says that it is better than the model to begin with.
    pub fn convinces(&self) -> bool {
        self.kind == Kind::Begin || !self.gains.is_empty() && self.gains.iter().all(Gain::convinces)
    }

    /// Mean share of the squares that is left, over the divisions.
    pub fn left(&self) -> f64 {
        1.0 - self.gains.iter().map(|g| g.share).sum::<f64>() / self.gains.len().max(1) as f64
    }

    /// Root mean square of the error at postures drawn at random and not fitted, m; `None` with too few postures.
    pub fn cross_validated(&self) -> Option<f64> {
        self.gains.first().map(|g| g.rms[1])
    }
}

/// Which model to use.
#[derive(Debug, Clone)]
pub struct Recommendation {
    /// All that were judged; the first is the model to begin with.
    pub choices: Vec<Choice>,
    /// Place of the one to use.
    pub chosen: usize,
    /// Samples that the steps set aside, and with them every model but the one to begin with.
    pub aside: Vec<String>,
    /// Postures.
    pub postures: usize,
}

impl Recommendation {
    /// Places of the choices that convince, best first; the model to begin with is always among them.
    pub fn ranked(&self) -> Vec<usize> {
        let mut places: Vec<usize> = (0..self.choices.len()).filter(|&k| self.choices[k].convinces()).collect();
        places.sort_by(|&a, &b| self.choices[a].left().total_cmp(&self.choices[b].left()));
        places
    }

    /// The choice of a kind, where it was offered.
    pub fn of_kind(&self, kind: Kind) -> Option<&Choice> {
        self.choices.iter().find(|c| c.kind == kind)
    }

    /// The model to use.
    pub fn choice(&self) -> &Choice {
        &self.choices[self.chosen]
    }
}

/// Candidates, by place, with the information that holds each.
type Held = Vec<(usize, f64)>;

/// Judges the model of an examination, `steps` beside it, the error curves, and `library`: ids with
/// their widths, plausible sizes in units of the noise that the library leaves. Of the steps, `bad` are samples without which all others
/// are known better: they are set aside whatever is chosen.
///
/// # Errors
/// When an effect does not go with the data, or a matrix cannot be factored.
pub fn recommend(
    datasets: &[(&str, &Dataset)],
    examination: &Examination,
    [steps, bad]: [&[String]; 2],
    library: &[(String, f64)],
) -> Result<Recommendation, IdentifyError> {
    let begin = examination.model();
    let divisions = postures(&examination.circumstances);
    let postures = divisions.count();
    let plain: Vec<&String> = steps.iter().filter(|id| effects::set_aside_by(id).is_none()).collect();
    let candidates = Candidates::new(examination, postures, &plain, library);
    let wide = examination.beside(datasets, candidates.all.clone())?;
    let mut linear = Linear::new(&wide, datasets);
    for (sample, id) in examination.problem().sample_ids().iter().enumerate() {
        linear.aside[sample] = steps.contains(&effects::setting_aside(id));
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
        for id in aside.iter().map(|id| effects::setting_aside(id)).filter(|id| kind != Kind::Begin || bad.contains(id)) {
            model = model.with(&id);
        }
        for (place, information) in held {
            let id = &candidates.all[place].id;
            model = model.with(id);
            let is_ordinary = begin.is_unregularised(id) || plain.contains(&id) && kind != Kind::Library;
            if !is_ordinary {
                model.width.insert(id.clone(), information.sqrt().recip());
            }
            added.push(id.clone());
        }
        Choice { kind, model, added, gains }
    };
    let choices: Vec<Choice> = held.into_iter().zip(gains).map(choice).collect();
    let mut all = Recommendation { choices, chosen: 0, aside, postures };
    all.chosen = all.ranked().first().copied().unwrap_or(0);
    Ok(all)
}

/// The candidates of all choices, each once, and those of each group by their places.
struct Candidates {
    all: Vec<Candidate>,
    steps: Held,
    library: Held,
    bands: Range<usize>,
}

impl Candidates {
    fn new(examination: &Examination, postures: usize, steps: &[&String], library: &[(String, f64)]) -> Self {
        let begin = examination.model();
        let bands = curves::bands(examination.problem().robot().joints(), postures);
        // The bands first: an effect of a step or of the library may be one of them, and they must stay one range.
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
            library: library.iter().map(|(id, width)| held(id, width * examination.yardstick.weight())).collect(),
            bands: 0..bands.len(),
            all,
        }
    }

    /// The choices worth judging, the model to begin with first; the library only while no more than `most` of its parameters are
    /// in effect.
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

/// What each of the choices gains over the first, one entry a division.
fn gains(
    divisions: &Postures,
    wide: &Examination,
    linear: &Linear<'_>,
    held: &[(Kind, Held)],
) -> Result<Vec<Vec<Gain>>, IdentifyError> {
    let variants: Vec<linear::Choice> = held.iter().map(|(_, held)| linear.with(held.iter().copied())).collect();
    let mut gains: Vec<Vec<Gain>> = vec![Vec::new(); held.len()];
    for folds in Folds::all(divisions, &wide.circumstances, &linear.places) {
        let division = folds.division;
        let products = linear.fold_products(folds);
        let before = linear.held_out(&products, &variants[0])?;
        for (variant, gains) in variants.iter().zip(&mut gains) {
            gains.extend(Gain::of(division, &before, &linear.held_out(&products, variant)?));
        }
    }
    Ok(gains)
}

/// Whether a place in the world is known. Where none is, what a hundred effects make of a new place shows only at places left out.
fn stands_somewhere(examination: &Examination) -> bool {
    !examination.problem().parameters().iter().any(|p| p.defines_world)
}
