//! How a campaign is divided to be predicted from its other parts: whole postures, drawn at random, in runs of time, and in blocks of
//! joint space. Each asks something else of a model: more of the same, the same arm later, and postures that were not near any other.

use rand::SeedableRng;
use rand::seq::SliceRandom;
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
            let joints: Vec<&[f64]> = circumstances.iter().map(|c| c.q.as_slice()).collect();
            all.push(Folds { division: Division::Blocks, of: postures.blocks(&joints, count, SEED), count });
        }
        all.extend(Folds::of_places(postures, places));
        all
    }
}

/// Fold of each sample where whole postures are drawn at random.
pub(in crate::assess) fn random_folds(circumstances: &[Circumstance]) -> Vec<usize> {
    let postures = postures(circumstances);
    let folds = Folds::random(postures.count());
    postures.of_samples().iter().map(|&p| folds.of[p]).collect()
}

/// Postures of a campaign, whatever the set-up or the target: what the arm does is the same.
pub(in crate::assess) fn postures(circumstances: &[Circumstance]) -> Postures {
    let joints: Vec<&[f64]> = circumstances.iter().map(|c| c.q.as_slice()).collect();
    Postures::of_joints(&joints, &vec![0; joints.len()])
}
