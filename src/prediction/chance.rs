//! Single random draws: a standard normal number, a chi-square, one of several items.

use rand::{Rng, RngExt};
use rand_distr::{ChiSquared, Distribution, StandardNormal};

pub fn normal(random: &mut impl Rng) -> f64 {
    StandardNormal.sample(random)
}

pub fn chi_squared(freedom: f64, random: &mut impl Rng) -> f64 {
    ChiSquared::new(freedom).map_or(freedom, |d| d.sample(random)).max(f64::MIN_POSITIVE)
}

/// Draws an index below `count`, with the logarithms `ln` of the weights.
pub fn one_of(count: usize, ln: impl Fn(usize) -> f64, random: &mut impl Rng) -> usize {
    let all: Vec<f64> = (0..count).map(ln).collect();
    let largest = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = all.iter().map(|l| (l - largest).exp()).collect();
    let mut left = random.random::<f64>() * weights.iter().sum::<f64>();
    for (k, w) in weights.iter().enumerate() {
        left -= w;
        if left <= 0.0 {
            return k;
        }
    }
    count - 1
}
