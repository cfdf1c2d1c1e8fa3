//! How a campaign is divided to be predicted from its other parts: whole postures, drawn at random, in runs of time, and in blocks of
//! joint space. Each asks something else of a model: more of the same, the same arm later, and postures that were not near any other.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::identify::Circumstance;
use crate::measure::Postures;

/// Parts of every division.
const FOLDS: usize = 10;

/// From so many postures on, blocks of joint space are divisions too: of fewer, each block is an extrapolation.
const BLOCKS_FROM: usize = 81;

/// Fewer places are no division: of two, each would be predicted from a single one.
const LEAST_PLACES: usize = 3;

/// Nothing else is random here; the same data give the same folds.
const SEED: u64 = 0x0ca1_1bf0;

/// Rounds of Lloyd's algorithm.
const ROUNDS: usize = 20;

/// What kind of division.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Division {
    /// Whole postures, drawn at random.
    Random,
    /// Runs of postures as they were taken.
    Time,
    /// Blocks of postures that are near each other in joint space.
    Blocks,
    /// Places where balls stand, each left out: a model that is good only where it was fitted shows here.
    Places,
}

impl Division {
    /// As in files.
    pub fn name(self) -> &'static str {
        match self {
            Division::Random => "postures",
            Division::Time => "time",
            Division::Blocks => "blocks",
            Division::Places => "places",
        }
    }

    /// In words, after "predicted from the others in".
    pub fn words(self) -> &'static str {
        match self {
            Division::Random => "random postures",
            Division::Time => "runs of time",
            Division::Blocks => "blocks of joint space",
            Division::Places => "places",
        }
    }
}

/// Fold of each posture.
#[derive(Debug, Clone)]
pub(super) struct Folds {
    pub division: Division,
    pub of: Vec<usize>,
    pub count: usize,
}

impl Folds {
    /// Whole postures, drawn at random.
    pub fn random(postures: usize) -> Folds {
        let count = FOLDS.min(postures);
        let mut order: Vec<usize> = (0..postures).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(SEED));
        let mut of = vec![0; postures];
        order.iter().enumerate().for_each(|(k, &p)| of[p] = k * count / postures);
        Folds { division: Division::Random, of, count }
    }

    /// Places left out one after the other, where every sample has one and there are three or more.
    pub fn of_places(postures: &Postures, places: &[Option<usize>]) -> Option<Folds> {
        let of: Option<Vec<usize>> = postures.members().iter().map(|samples| places[samples[0]]).collect();
        let of = of?;
        let count = of.iter().max().map_or(0, |p| p + 1);
        (count >= LEAST_PLACES).then_some(Folds { division: Division::Places, of, count })
    }

    /// The divisions that a campaign of these postures bears; `places` of each sample, counted from 0.
    pub fn all(postures: &Postures, circumstances: &[Circumstance], places: &[Option<usize>]) -> Vec<Folds> {
        let n = postures.count();
        let count = FOLDS.min(n);
        let time = (0..n).map(|p| p * count / n).collect();
        let mut all = vec![Folds::random(n), Folds { division: Division::Time, of: time, count }];
        if n >= BLOCKS_FROM {
            all.push(Folds { division: Division::Blocks, of: blocks(postures, circumstances, count), count });
        }
        all.extend(Folds::of_places(postures, places));
        all
    }
}

/// k-means in joint space, every joint alike, from centres that are far apart.
fn blocks(postures: &Postures, circumstances: &[Circumstance], count: usize) -> Vec<usize> {
    let points: Vec<&[f64]> = postures.members().iter().map(|s| circumstances[s[0]].q.as_slice()).collect();
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut centres: Vec<Vec<f64>> = vec![points[random.random_range(0..points.len())].to_vec()];
    let mut nearest: Vec<f64> = points.iter().map(|p| distance(p, &centres[0])).collect();
    while centres.len() < count {
        let mut left = random.random::<f64>() * nearest.iter().sum::<f64>();
        let chosen = nearest.iter().position(|d| {
            left -= d;
            left <= 0.0
        });
        let centre = points[chosen.unwrap_or(points.len() - 1)].to_vec();
        nearest.iter_mut().zip(&points).for_each(|(d, p)| *d = d.min(distance(p, &centre)));
        centres.push(centre);
    }
    let closest = |p: &[f64], centres: &[Vec<f64>]| {
        (0..centres.len()).min_by(|&a, &b| distance(p, &centres[a]).total_cmp(&distance(p, &centres[b]))).unwrap_or(0)
    };
    let mut of: Vec<usize> = vec![0; points.len()];
    for _ in 0..ROUNDS {
        of = points.iter().map(|p| closest(p, &centres)).collect();
        for (k, centre) in centres.iter_mut().enumerate() {
            let own: Vec<&&[f64]> = points.iter().zip(&of).filter(|(_, o)| **o == k).map(|(p, _)| p).collect();
            if !own.is_empty() {
                (0..centre.len()).for_each(|j| centre[j] = own.iter().map(|p| p[j]).sum::<f64>() / own.len() as f64);
            }
        }
    }
    of
}
