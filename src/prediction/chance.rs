//! Single random draws: a standard normal number, a chi-square, one of several items.

use rand::{Rng, RngExt};
use rand_distr::{ChiSquared, Distribution, StandardNormal};

pub fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

pub fn chi_squared(freedom: f64, random: &mut impl Rng) -> f64 {
    ChiSquared::new(freedom).map_or(freedom, |d| d.sample(random)).max(f64::MIN_POSITIVE)
}

/// Largest number of items among which one is drawn.
const MOST: usize = 64;

/// Draws an index below `count` (at most 64), with the logarithms `ln` of the weights.
pub fn one_of(count: usize, ln: impl Fn(usize) -> f64, random: &mut impl Rng) -> usize {
    let mut room = [0.0; MOST];
    let weights = &mut room[..count];
    weights.iter_mut().enumerate().for_each(|(k, w)| *w = ln(k));
    let largest = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    weights.iter_mut().for_each(|w| *w = (*w - largest).exp());
    let mut left = random.random::<f64>() * weights.iter().sum::<f64>();
    for (k, w) in weights.iter().enumerate() {
        left -= w;
        if left <= 0.0 {
            return k;
        }
    }
    count - 1
}
