//! Drawing postures at random, and keeping count of why some are refused.
//!
//! Every draw has a random stream of its own, named by (seed, purpose, number of the draw), and draws are taken in order of number:
//! the same seed gives the same postures on any number of threads, and fewer are the first of more.

use std::fmt;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use thiserror::Error;

use crate::units::{DEG, MM};

/// How far a posture must keep from trouble.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// From every joint limit, rad.
    pub limit: f64,
    /// From a singularity: the least [`crate::robot::dexterity`], m/rad.
    pub dexterity: f64,
    /// Between bodies while a ball is probed, m: a gauge that is centred on a ball stands there, whatever is wrong with the arm.
    pub clearance: f64,
    /// Between bodies in postures that nothing holds in their place, m: there they are off by what is wrong with the arm.
    pub free: f64,
}

impl Default for Margins {
    /// 2 deg from limits (a centring moves a joint by tenths), |sin A5| of about 0.1 on a KR 6, and 5 mm of air.
    fn default() -> Self {
        Margins { limit: 2.0 * DEG, dexterity: 0.02, clearance: 5.0 * MM, free: 5.0 * MM }
    }
}

/// How many postures were refused for each reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Refusals {
    /// No joint angles reach the pose.
    pub reach: usize,
    /// Outside joint limits, or too near one.
    pub limits: usize,
    /// Too near a singularity.
    pub singular: usize,
    /// Something touches, or nearly.
    pub touching: usize,
    /// The straight approach is not free, or leaves the joint limits.
    pub approach: usize,
    /// The reflector looks away from the tracker.
    pub facing: usize,
    /// Something stands between the tracker and the reflector.
    pub hidden: usize,
}

impl fmt::Display for Refusals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reasons = [
            (self.reach, "out of reach"),
            (self.limits, "outside joint limits"),
            (self.singular, "near a singularity"),
            (self.touching, "touching something"),
            (self.approach, "without a free approach"),
            (self.facing, "facing away from the tracker"),
            (self.hidden, "hidden from the tracker"),
        ];
        let mut first = true;
        for (count, reason) in reasons.into_iter().filter(|(count, _)| *count > 0) {
            write!(f, "{}{count} {reason}", if first { "" } else { ", " })?;
            first = false;
        }
        Ok(())
    }
}

impl Refusals {
    pub(super) fn add(&mut self, other: &Refusals) {
        self.reach += other.reach;
        self.limits += other.limits;
        self.singular += other.singular;
        self.touching += other.touching;
        self.approach += other.approach;
        self.facing += other.facing;
        self.hidden += other.hidden;
    }
}

/// Why there is no pool.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum PoolError {
    /// A ball cannot be probed in any posture that was tried.
    #[error("ball {ball} cannot be probed: of {tried} tool poses tried, postures were {because}")]
    NoPose {
        /// Its name.
        ball: String,
        /// Tool poses tried.
        tried: usize,
        /// Postures refused.
        because: Refusals,
    },
    /// No posture stands free.
    #[error("no posture stands free: of {tried} tried, {because}")]
    NoFreePose {
        /// Postures tried.
        tried: usize,
        /// Postures refused.
        because: Refusals,
    },
    /// A ball's body is not among the surroundings.
    #[error("ball {ball}: nothing called '{body}' stands in the cell")]
    UnknownBody {
        /// Its name.
        ball: String,
        /// The body named.
        body: String,
    },
}

/// Draws spent before giving up: these first, and so many more for each one found. A ball that less than one tool pose in a hundred
/// can probe stands in the wrong place.
const FIRST_DRAWS: usize = 2_000;
const DRAWS_PER_FOUND: usize = 100;
/// Draws handed out at a time: many enough for all threads, few enough to waste little.
const BLOCK: [usize; 2] = [64, 2048];
/// Takes draws in order until `wanted` results are found, or too many were in vain.
pub(super) fn drawn<W: Send, R: Send>(
    wanted: usize,
    workspace: impl Fn() -> W + Sync + Send,
    draw: impl Fn(&mut W, u64) -> (Vec<R>, Refusals) + Sync + Send,
) -> (Vec<R>, usize, Refusals) {
    let (mut found, mut tried, mut because) = (Vec::new(), 0, Refusals::default());
    while found.len() < wanted && tried < FIRST_DRAWS + DRAWS_PER_FOUND * found.len() {
        let block = (wanted - found.len()).clamp(BLOCK[0], BLOCK[1]);
        let numbers = tried as u64..(tried + block) as u64;
        let results: Vec<_> = numbers.into_par_iter().map_init(&workspace, &draw).collect();
        for (results, refused) in results {
            found.extend(results);
            because.add(&refused);
        }
        tried += block;
    }
    found.truncate(wanted);
    (found, tried, because)
}

/// What draws are for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Purpose {
    /// Probing the ball of this place.
    Ball(usize),
    /// Standing free.
    Free,
}

/// A random stream of its own for each draw.
pub(super) fn stream(seed: u64, purpose: Purpose, number: u64) -> ChaCha8Rng {
    // The top byte keeps the streams of poses apart from all others of the same seed.
    let purpose = match purpose {
        Purpose::Free => 0xB0_0000,
        Purpose::Ball(ball) => 0xB0_0001 + ball as u64,
    };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream((purpose << 40) | number);
    random
}

/// Limits less `margin` at both ends; the middle where nothing is left.
pub(super) fn within([low, high]: [f64; 2], margin: f64) -> [f64; 2] {
    if low + margin < high - margin { [low + margin, high - margin] } else { [0.5 * (low + high); 2] }
}

/// A number between two, all equally likely.
pub(super) fn between([low, high]: [f64; 2], random: &mut ChaCha8Rng) -> f64 {
    low + (high - low) * random.random::<f64>()
}
