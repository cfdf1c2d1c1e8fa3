//! Divisions of a campaign, of which each part is predicted from the others: whole postures chosen at random, in runs
//! of time, in blocks of joint space, and by places. Each tests a model differently: at similar postures, at a later
//! time, at postures far from any other, and at other places.

use nalgebra::Vector3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::Examination;
use crate::identify::problem::{SampleContext, Use};
use crate::measure::dataset::{Measured, NamedDataset};
use crate::measure::poses::Postures;
pub(crate) use crate::residuals::misfit::reach;

/// Number of folds of a division, except by places.
const FOLDS: usize = 10;

/// Number of postures from which on blocks of joint space are used too: with fewer, each block is an extrapolation (decision
/// 0025).
const BLOCKS_FROM: usize = 81;

/// Fewest places for a division: with two, each would be predicted from a single one (decision 0025).
const LEAST_PLACES: usize = 3;

/// Fixed seed: the same data give the same folds.
const SEED: u64 = 0x0ca1_1bf0;

/// Kind of division.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Division {
    /// Whole postures chosen at random.
    Random,
    /// Runs of postures in the order of measurement.
    Time,
    /// Blocks of postures that are near each other in joint space.
    Blocks,
    /// Places of balls, each left out in turn: reveals a model that is good only where it was fitted.
    Places,
}

impl Division {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Division::Random => "postures",
            Division::Time => "time",
            Division::Blocks => "blocks",
            Division::Places => "places",
        }
    }

    /// Description, to follow "predicted from the others in".
    pub fn words(self) -> &'static str {
        match self {
            Division::Random => "random postures",
            Division::Time => "runs of time",
            Division::Blocks => "blocks of joint space",
            Division::Places => "places",
        }
    }
}

/// A division, with the fold of each posture.
#[derive(Debug, Clone)]
pub(crate) struct Folds {
    pub division: Division,
    pub of: Vec<usize>,
    pub count: usize,
}

impl Folds {
    /// Divides whole postures at random.
    pub fn random(postures: usize) -> Folds {
        let count = FOLDS.min(postures);
        let mut order: Vec<usize> = (0..postures).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(SEED));
        let mut of = vec![0; postures];
        order.iter().enumerate().for_each(|(k, &p)| of[p] = k * count / postures);
        Folds { division: Division::Random, of, count }
    }

    /// Makes each place a fold; `None` unless every posture has a place and there are three or more.
    pub fn of_places(postures: &Postures, places: &[Option<usize>]) -> Option<Folds> {
        let of: Option<Vec<usize>> = postures.members().iter().map(|samples| places[samples[0]]).collect();
        let of = of?;
        let count = of.iter().max().map_or(0, |p| p + 1);
        (count >= LEAST_PLACES).then_some(Folds { division: Division::Places, of, count })
    }

    /// Returns all divisions that a campaign of these postures allows; `places` are those of the samples, counted from
    /// 0.
    pub fn all(postures: &Postures, contexts: &[SampleContext], places: &[Option<usize>]) -> Vec<Folds> {
        let n = postures.count();
        let count = FOLDS.min(n);
        let time = (0..n).map(|p| p * count / n).collect();
        let mut all = vec![Folds::random(n), Folds { division: Division::Time, of: time, count }];
        if n >= BLOCKS_FROM {
            let joints: Vec<&[f64]> = contexts.iter().map(|c| c.q.as_slice()).collect();
            all.push(Folds { division: Division::Blocks, of: postures.blocks(&joints, count, SEED), count });
        }
        all.extend(Folds::of_places(postures, places));
        all
    }
}

/// Returns the fold of each sample, with whole postures chosen at random.
pub(crate) fn random_folds(contexts: &[SampleContext]) -> Vec<usize> {
    let postures = postures(contexts);
    let folds = Folds::random(postures.count());
    postures.of_samples().iter().map(|&p| folds.of[p]).collect()
}

/// Groups a campaign by posture, regardless of set-up and target, as the error of the arm is the same.
pub(crate) fn postures(contexts: &[SampleContext]) -> Postures {
    let joints: Vec<&[f64]> = contexts.iter().map(|c| c.q.as_slice()).collect();
    Postures::of_joints(&joints, &vec![0; joints.len()])
}

/// Balls nearer to each other than this share of the arm's reach count as one place.
const ONE_PLACE: f64 = 0.1;

/// Returns the place of each sample's ball; balls that are near each other share one.
pub(crate) fn places_of_balls(examination: &Examination, datasets: &[NamedDataset<'_>]) -> Vec<Option<usize>> {
    let reach = reach(examination.problem.robot());
    let mut known: Vec<Vector3<f64>> = Vec::new();
    let rows =
        datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s)).map(move |s| (d.dataset, s)));
    rows.map(|(d, s)| match s.measured {
        Measured::Ball { ball, .. } => {
            let at = d.balls[ball].position;
            Some(known.iter().position(|k| (k - at).norm() < ONE_PLACE * reach).unwrap_or_else(|| {
                known.push(at);
                known.len() - 1
            }))
        }
        Measured::Point(_) | Measured::Distance { .. } => None,
    })
    .collect()
}

/// Place of each sample's ball, counted from 0; `None` if some sample has none, or there is only one place.
pub(crate) fn places(examination: &Examination, datasets: &[NamedDataset<'_>]) -> Option<Vec<usize>> {
    let places: Option<Vec<usize>> = places_of_balls(examination, datasets).into_iter().collect();
    places.filter(|p| p.iter().any(|&place| place > 0))
}
