//! Divisions of measured campaigns into a fitted and a judged part.

use std::borrow::Cow;

use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample, SampleSet};
use calibench::measure::poses::Postures;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Number of poses of a held-out campaign from which its base and tool are found.
const FRAME_POSES: usize = 50;

/// With two places, each would be predicted from a single one.
const LEAST_PLACES: usize = 3;

/// Kind of division; each tests another property of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Division {
    /// Whole postures held out at random: interpolation.
    Postures,
    /// A short campaign, judged on all other postures.
    Short,
    /// Blocks of joint space held out: postures far from any fitted one.
    Blocks,
    /// Places of an artifact held out.
    Places,
    /// Whole campaigns held out: the same robot set up again.
    Campaigns,
}

/// One division of the data into a fitted and a judged part.
#[derive(Debug, Clone)]
pub struct Case<'a> {
    /// Name of the data.
    pub robot: &'a str,
    /// The division in words.
    pub fold: String,
    /// Kind of division.
    pub division: Division,
    pub(super) fitted: Vec<(&'a str, Cow<'a, Dataset>)>,
    pub(super) judged: Dataset,
    /// True if the judged rows belong to another set-up, whatever their sessions are called.
    pub(super) anew: bool,
}

/// Whole postures of a dataset held out at random, in `folds` parts, one after the other.
pub fn by_postures<'a>(robot: &'a str, dataset: &'a Dataset, folds: usize, seed: u64) -> Vec<Case<'a>> {
    let of = shuffled(dataset, seed);
    let postures = of.iter().max().map_or(0, |p| p + 1).max(1);
    let case = |f: usize| {
        let is_judged = |i: usize| of[i] * folds / postures == f;
        cut(robot, dataset, Division::Postures, format!("postures {}/{folds}", f + 1), is_judged)
    };
    (0..folds).filter_map(case).collect()
}

/// Campaigns of `postures` random postures, judged on all others.
pub fn by_short_campaigns<'a>(robot: &'a str, dataset: &'a Dataset, postures: usize, draws: usize, seed: u64) -> Vec<Case<'a>> {
    let case = |k: usize| {
        let of = shuffled(dataset, seed.wrapping_mul(1000).wrapping_add(k as u64));
        let fold = format!("{postures} postures, draw {}", k + 1);
        cut(robot, dataset, Division::Short, fold, |i| of[i] >= postures)
    };
    (0..draws).filter_map(case).collect()
}

/// Blocks of neighbouring postures in joint space, held out one after the other.
pub fn by_blocks<'a>(robot: &'a str, dataset: &'a Dataset, blocks: usize, seed: u64) -> Vec<Case<'a>> {
    let joints = joints_of(dataset);
    let postures = Postures::of_joints(&joints, &vec![0; joints.len()]);
    let of = postures.blocks(&joints, blocks, seed);
    let case = |b: usize| {
        let is_judged = |i: usize| of[postures.of_samples()[i]] == b;
        cut(robot, dataset, Division::Blocks, format!("block {}/{blocks}", b + 1), is_judged)
    };
    (0..blocks).filter_map(case).collect()
}

/// Places of an artifact (balls whose names agree before a `/`), held out one after the other; none if there are fewer than
/// three.
pub fn by_places<'a>(robot: &'a str, dataset: &'a Dataset) -> Vec<Case<'a>> {
    let place_of = |ball: usize| dataset.balls[ball].id.split('/').next().unwrap_or_default();
    let mut places: Vec<&str> = (0..dataset.balls.len()).map(place_of).collect();
    places.dedup();
    if places.len() < LEAST_PLACES {
        return Vec::new();
    }
    let case = |place: &&str| {
        let is_judged =
            |i: usize| matches!(dataset.samples[i].measured, Measured::Ball { ball, .. } if place_of(ball) == *place);
        cut(robot, dataset, Division::Places, format!("place {place}"), is_judged)
    };
    places.iter().filter_map(case).collect()
}

/// Each campaign predicted by the robot of the others, its base and tool found from fifty of its poses.
pub fn by_campaigns<'a>(datasets: &[NamedDataset<'a>], seed: u64) -> Vec<Case<'a>> {
    if datasets.len() < 2 {
        return Vec::new();
    }
    let case = |k: usize| {
        let others = || datasets.iter().enumerate().filter(move |(i, _)| *i != k).map(|(_, d)| *d);
        let trained: Vec<&str> = others().map(|d| d.name).collect();
        let NamedDataset { name: robot, dataset: left_out } = datasets[k];
        let mut judged = left_out.clone();
        for (sample, p) in judged.samples.iter_mut().zip(shuffled(left_out, seed)) {
            sample.set = if p < FRAME_POSES { SampleSet::Fit } else { SampleSet::Validation };
        }
        Case {
            robot,
            fold: format!("robot of {}", trained.join(" and ")),
            division: Division::Campaigns,
            fitted: others().map(|NamedDataset { name, dataset: d }| (name, Cow::Borrowed(d))).collect(),
            judged,
            anew: true,
        }
    };
    (0..datasets.len()).map(case).collect()
}

/// Splits a dataset in two; `None` if either part would be empty.
fn cut<'a>(
    robot: &'a str,
    dataset: &Dataset,
    division: Division,
    fold: String,
    is_judged: impl Fn(usize) -> bool,
) -> Option<Case<'a>> {
    let part = |judged: bool| {
        let kept = dataset.samples.iter().enumerate().filter(|(i, _)| is_judged(*i) == judged);
        let set = if judged { SampleSet::Validation } else { SampleSet::Fit };
        let samples: Vec<Sample> = kept.map(|(_, s)| Sample { set, ..s.clone() }).collect();
        (!samples.is_empty()).then(|| Dataset { samples, ..dataset.clone() })
    };
    let (fitted, judged) = (part(false)?, part(true)?);
    Some(Case { robot, fold, division, fitted: vec![(robot, Cow::Owned(fitted))], judged, anew: false })
}

/// The number of each row's posture in a random order.
fn shuffled(dataset: &Dataset, seed: u64) -> Vec<usize> {
    let joints = joints_of(dataset);
    let postures = Postures::of_joints(&joints, &vec![0; joints.len()]);
    let mut order: Vec<usize> = (0..postures.count()).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    postures.of_samples().iter().map(|&p| order[p]).collect()
}

fn joints_of(dataset: &Dataset) -> Vec<&[f64]> {
    dataset.samples.iter().map(|s| s.q.as_slice()).collect()
}
