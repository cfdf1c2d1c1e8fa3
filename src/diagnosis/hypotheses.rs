//! Hypotheses of what is missing: every candidate of the library, and every family whose place (an order, a moment, a
//! sample) is found by a scan.

mod hypothesis;
mod steps;
mod trial;

use std::borrow::Cow;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::background::Background;
use super::evidence::SIZES;
use super::examination::Examination;
use super::library::Untestable;
use super::sweep::{self, Sweep};
use crate::effects;
use crate::effects::EffectId;
use crate::effects::family::Scan;
use crate::identify::fit::FitError;
use crate::robot::JointKind;

pub use hypothesis::{Hypothesis, Moment, Place};
pub(crate) use steps::with_undecided;
use trial::{Trial, Tried, TriedPlace, plausible};

/// Integer orders tested on every joint; once and twice per turn are separate effects.
const ORDERS: std::ops::RangeInclusive<u32> = 3..=140;

/// Common ratios of strain-wave gears, used if the robot's are unknown: their ripple occurs once and twice per turn of
/// the wave generator.
const USUAL_RATIOS: [u32; 11] = [30, 50, 51, 80, 81, 100, 101, 120, 121, 160, 161];

/// Products of sine and cosine of two angles.
const PRODUCTS: usize = 4;

/// All hypotheses on a fitted model, in the order of the catalogue, scanned families last.
pub(crate) fn hypotheses(examination: &Examination, background: &Background) -> (Vec<Hypothesis>, Vec<Untestable>) {
    let mut all = named(examination, background);
    let joints = examination.problem.robot().joints();
    let harmonics: Vec<Option<Hypothesis>> =
        (0..joints).into_par_iter().map(|j| harmonic(examination, background, j)).collect();
    all.extend(harmonics.into_iter().flatten());
    let products: Vec<Option<Hypothesis>> = (0..joints).into_par_iter().map(|j| product(examination, background, j)).collect();
    all.extend(products.into_iter().flatten());
    let (steps, untestable) = steps::steps(examination, background);
    all.extend(steps);
    all.extend(outlier(examination, background));
    (all, untestable)
}

fn named(examination: &Examination, background: &Background) -> Vec<Hypothesis> {
    let of_candidate = |k: usize| {
        let candidate = &examination.library.candidates[k];
        let span = examination.spans[k];
        let (first, count) = (span.first, span.count);
        let gram = examination.gram.view((first, first), (count, count)).into_owned();
        let z = examination.z.rows(first, count).into_owned();
        let along = background.along(&examination.gram.columns(first, count).into_owned());
        let seen = examination.seen(k);
        let (explained, coefficients) = seen.explained();
        let ln_evidence = seen.ln_evidence(&examination.remainder, &SIZES);
        // Effects that belong to every model are judged without the background, which could otherwise stand in for
        // them.
        let ln_evidence_against_background = if examination.model.is_unregularised(&candidate.id) {
            ln_evidence
        } else {
            background.ln_evidence_of(&gram, &z, &along, &SIZES)
        };
        Hypothesis {
            effect: candidate.id.clone(),
            in_model: candidate.id.clone(),
            place: None,
            ln_evidence,
            ln_evidence_against_background,
            explains: explained / examination.remainder.squares,
            coefficients,
            visible: examination.visible(k),
            places: 1,
            moment: None,
        }
    };
    (0..examination.library.candidates.len()).into_par_iter().map(of_candidate).collect()
}

/// A ripple of joint `j` with unknown order.
fn harmonic(examination: &Examination, background: &Background, j: usize) -> Option<Hypothesis> {
    let robot = examination.problem.robot();
    let mut orders: Vec<u32> = ORDERS.collect();
    if robot.gear_ratios.is_empty() {
        orders.extend(USUAL_RATIOS.iter().flat_map(|&n| [n, 2 * n]));
        orders.sort_unstable();
        orders.dedup();
    }
    let id = |k: u32| EffectId::member(EffectId::HARMONIC, format_args!("{}:{k}", j + 1));
    orders.retain(|&k| !examination.model.lists(&id(k)) && examination.library.place(&id(k)).is_none());
    let plausible = plausible(examination, &id(*orders.first()?))?;
    let features = waves(&examination.contexts.iter().map(|at| at.q[j]).collect::<Vec<f64>>(), &orders);
    let sweep = Sweep::new(examination, background, &sweep::joint(&examination.contexts, j), Cow::Owned(features));
    let trial = |(b, &k): (usize, &u32)| {
        Trial::new(
            examination,
            background,
            TriedPlace { place: Some(Place::Order(k)), in_model: id(k) },
            &sweep.block(2 * b, 2, plausible),
        )
    };
    Tried::of(orders.par_iter().enumerate().map(trial).collect()).hypothesis(examination, EffectId::clone)
}

/// An error of joint `j` by two joint angles at once, whichever they are.
fn product(examination: &Examination, background: &Background, j: usize) -> Option<Hypothesis> {
    let robot = examination.problem.robot();
    let turns = |j: &usize| robot.kind(*j) == JointKind::Revolute;
    let joints: Vec<usize> = (0..robot.joints()).filter(turns).collect();
    let id = |[a, b]: [usize; 2]| EffectId::member(EffectId::PRODUCT, format_args!("{}:{}:{}", j + 1, a + 1, b + 1));
    let of_pairs = joints.iter().enumerate().flat_map(|(k, &a)| joints[k + 1..].iter().map(move |&b| [a, b]));
    let pairs: Vec<[usize; 2]> = of_pairs.filter(|&pair| !examination.model.lists(&id(pair))).collect();
    let plausible = plausible(examination, &id(*pairs.first().filter(|_| turns(&j))?))?;
    let contexts = &examination.contexts;
    let feature = |i: usize, c: usize| {
        let ([a, b], [of_a, of_b]) = (pairs[c / PRODUCTS], [c % PRODUCTS / 2, c % 2]);
        let wave = |q: f64, of: usize| if of == 0 { q.sin() } else { q.cos() };
        wave(contexts[i].q[a], of_a) * wave(contexts[i].q[b], of_b)
    };
    let features = DMatrix::from_fn(contexts.len(), PRODUCTS * pairs.len(), feature);
    let sweep = Sweep::new(examination, background, &sweep::joint(contexts, j), Cow::Owned(features));
    let trial = |(k, &pair): (usize, &[usize; 2])| {
        let place = TriedPlace { place: None, in_model: id(pair) };
        Trial::new(examination, background, place, &sweep.block(PRODUCTS * k, PRODUCTS, plausible))
    };
    Tried::of(pairs.iter().enumerate().map(trial).collect()).hypothesis(examination, EffectId::clone)
}

/// Sine and cosine of each order times each angle (rad), two columns per order; `orders` is ascending. Computed by
/// recurrence over the orders: the error after some hundred orders stays below 1e-13.
fn waves(angles: &[f64], orders: &[u32]) -> DMatrix<f64> {
    let once: Vec<(f64, f64)> = angles.iter().map(|q| q.sin_cos()).collect();
    let mut now = vec![(0.0, 1.0); angles.len()];
    let mut features = DMatrix::zeros(angles.len(), 2 * orders.len());
    let mut order = 0;
    for (b, &k) in orders.iter().enumerate() {
        while order < k {
            for ((sin, cos), (s, c)) in now.iter_mut().zip(&once) {
                (*sin, *cos) = (*sin * c + *cos * s, *cos * c - *sin * s);
            }
            order += 1;
        }
        features.column_mut(2 * b).iter_mut().zip(&now).for_each(|(x, (sin, _))| *x = *sin);
        features.column_mut(2 * b + 1).iter_mut().zip(&now).for_each(|(x, (_, cos))| *x = *cos);
    }
    features
}

/// A single sample that disagrees with all others.
fn outlier(examination: &Examination, background: &Background) -> Option<Hypothesis> {
    let ids = examination.problem.sample_ids();
    let plausible = plausible(examination, &effects::catalogue::setting_aside(ids.first()?))?;
    let sweep = Sweep::of_each_sample(examination, background, &sweep::base(&examination.contexts));
    let trial = |(i, id): (usize, &String)| {
        let in_model = effects::catalogue::setting_aside(id);
        let is_new = !examination.model.lists(&in_model);
        let place = TriedPlace { place: Some(Place::Sample(id.clone())), in_model: in_model.into() };
        is_new.then(|| Trial::new(examination, background, place, &sweep.of_sample(i, plausible)))
    };
    let trials: Vec<Option<Trial>> = ids.par_iter().enumerate().map(trial).collect();
    Tried::of(trials.into_iter().flatten().collect()).hypothesis(examination, |_| EffectId::OUTLIER.into())
}

/// Reason why no place was found for an effect.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unplaced {
    /// The data lack something that is needed.
    #[error("finding its place needs {needs} of samples.csv")]
    Needs {
        /// The data that are missing.
        needs: &'static str,
    },
    /// The model already contains the effect at every place.
    #[error("the model contains it at every place already")]
    NoneLeft,
    /// The scan could not be computed.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Returns the id that an effect named without its place (`base_step`, `joint_step:2`, `harmonic:2`, `outlier`) has in
/// a model: with the place of highest evidence against the background, found by a scan. Any other id is returned
/// unchanged.
///
/// # Errors
/// When the place cannot be found in these data.
pub fn place(examination: &Examination, id: &str) -> Result<String, Unplaced> {
    let subject = examination.model.subject(examination.problem.robot(), &examination.library.balls);
    let family = examination.model.family(id);
    let lacks_its_place = family.is_some_and(|f| f.scanned(&subject, "").iter().any(|whole| whole.trim_end_matches(':') == id));
    if !lacks_its_place {
        return Ok(id.to_owned());
    }
    let background = || Background::new(examination);
    let found = match (family.map(|f| f.scan), EffectId::new(id).number(0)) {
        (Some(Scan::Order), Some(joint)) => harmonic(examination, &background()?, joint - 1),
        (Some(Scan::Sample), _) => outlier(examination, &background()?),
        (Some(Scan::Time), _) => {
            if let Some(needs) = steps::lacking(examination) {
                return Err(Unplaced::Needs { needs });
            }
            steps::step(examination, &background()?, id)
        }
        _ => return Ok(id.to_owned()),
    };
    found.map(|h| h.in_model.into()).ok_or(Unplaced::NoneLeft)
}
