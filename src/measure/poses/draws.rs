//! Random drawing of postures, with counts of the reasons for refusal.
//!
//! Every draw has its own random stream, identified by (seed, purpose, number of the draw), and draws are taken in numerical
//! order: the same seed gives the same postures on any number of threads, and a smaller set is the beginning of a larger one.

use std::fmt;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use thiserror::Error;

use crate::units::{DEG, MM};

/// Margins that a posture must keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Distance from every joint limit, rad.
    pub limit: f64,
    /// Distance from a singularity: the least [`crate::robot::inverse::dexterity`], m/rad.
    pub dexterity: f64,
    /// Gap between bodies while a ball is probed, m: a gauge centred on a ball is in place there, whatever the errors of the
    /// arm.
    pub clearance: f64,
    /// Gap between bodies in free postures, m: there they are displaced by the errors of the arm.
    pub free: f64,
}

impl Default for Margins {
    /// 2 deg from limits (a centring moves a joint by tenths), |sin A5| of about 0.1 on a KR 6, and 5 mm between bodies.
    fn default() -> Self {
        Margins { limit: 2.0 * DEG, dexterity: 0.02, clearance: 5.0 * MM, free: 5.0 * MM }
    }
}

/// Number of postures refused for each reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Refusals {
    /// No joint angles reach the pose.
    pub reach: usize,
    /// Outside joint limits, or too close to one.
    pub limits: usize,
    /// Too close to a singularity.
    pub singular: usize,
    /// Bodies touch or are too close.
    pub touching: usize,
    /// The straight approach is not free, or leaves the joint limits.
    pub approach: usize,
    /// The reflector faces away from the tracker.
    pub facing: usize,
    /// A body is between the tracker and the reflector.
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

/// Reason why there is no pool.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum PoolError {
    /// A ball cannot be probed in any posture tried.
    #[error("ball {ball} cannot be probed: of {tried} tool poses tried, postures were {because}")]
    NoPose {
        /// Name of the ball.
        ball: String,
        /// Tool poses tried.
        tried: usize,
        /// Postures refused.
        because: Refusals,
    },
    /// No posture is free.
    #[error("no posture is free of collision: of {tried} tried, {because}")]
    NoFreePose {
        /// Postures tried.
        tried: usize,
        /// Postures refused.
        because: Refusals,
    },
    /// The body named for a ball is not among the surroundings.
    #[error("ball {ball}: the cell has nothing called '{body}'")]
    UnknownBody {
        /// Name of the ball.
        ball: String,
        /// Name of the body.
        body: String,
    },
}

/// Draws before giving up, to which [`DRAWS_PER_FOUND`] are added for each posture found.
const FIRST_DRAWS: usize = 2_000;
/// Further draws for each posture found: a ball that can be probed by less than one tool pose in a hundred is in the wrong
/// place.
const DRAWS_PER_FOUND: usize = 100;
/// Smallest and largest number of draws per batch: enough for all threads, with little waste.
const BLOCK: [usize; 2] = [64, 2048];
/// Takes draws in order until `count` results are found, or the limit on draws is reached.
pub(super) fn drawn<W: Send, R: Send>(
    count: usize,
    workspace: impl Fn() -> W + Sync + Send,
    draw: impl Fn(&mut W, u64) -> (Vec<R>, Refusals) + Sync + Send,
) -> (Vec<R>, usize, Refusals) {
    let (mut found, mut tried, mut because) = (Vec::new(), 0, Refusals::default());
    while found.len() < count && tried < FIRST_DRAWS + DRAWS_PER_FOUND * found.len() {
        let block = (count - found.len()).clamp(BLOCK[0], BLOCK[1]);
        let numbers = tried as u64..(tried + block) as u64;
        let results: Vec<_> = numbers.into_par_iter().map_init(&workspace, &draw).collect();
        for (results, refused) in results {
            found.extend(results);
            because.add(&refused);
        }
        tried += block;
    }
    found.truncate(count);
    (found, tried, because)
}

/// Purpose of a draw.
#[derive(Debug, Clone, Copy)]
pub(super) enum Purpose {
    /// Probing the ball of this index.
    Ball(usize),
    /// A free posture.
    Free,
}

/// Creates the random stream of a draw.
pub(super) fn stream(seed: u64, purpose: Purpose, number: u64) -> ChaCha8Rng {
    // The top byte separates the streams of poses from all others of the same seed.
    let purpose = match purpose {
        Purpose::Free => 0xB0_0000,
        Purpose::Ball(ball) => 0xB0_0001 + ball as u64,
    };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream((purpose << 40) | number);
    random
}

/// Limits reduced by `margin` at both ends; the middle if nothing remains.
pub(super) fn within([low, high]: [f64; 2], margin: f64) -> [f64; 2] {
    if low + margin < high - margin { [low + margin, high - margin] } else { [0.5 * (low + high); 2] }
}

/// A uniformly distributed number between two limits.
pub(super) fn between([low, high]: [f64; 2], random: &mut ChaCha8Rng) -> f64 {
    low + (high - low) * random.random::<f64>()
}
