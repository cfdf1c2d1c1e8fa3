//! Randomness by name: one independent stream per seed, trial and source of noise.

use nalgebra::Vector3;
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::StandardNormal;

/// The random streams of one trial.
///
/// A stream is ChaCha8 keyed by the seed and the name of its source, with the trial as its nonce. No stream is seeded from
/// another, so trial 17 alone is trial 17 of 500, on any number of threads, and a new source of noise changes no draw of the
/// others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Streams {
    /// The study's seed.
    pub seed: u64,
    /// Trial number, counted from 0.
    pub trial: u64,
}

impl Streams {
    /// The streams of the noise on a later visit to the same cell; visit 0 is the first.
    #[must_use]
    pub fn of_visit(&self, visit: u64) -> Self {
        let seed = if visit == 0 { self.seed } else { fnv1a(format!("visit {visit} to {}", self.seed).as_bytes()) };
        Streams { seed, ..*self }
    }

    /// Returns the stream of the noise called `source`, from its beginning.
    pub fn stream(&self, source: &str) -> ChaCha8Rng {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&self.seed.to_le_bytes());
        key[8..16].copy_from_slice(&fnv1a(source.as_bytes()).to_le_bytes());
        let mut rng = ChaCha8Rng::from_seed(key);
        rng.set_stream(self.trial);
        rng
    }
}

/// A Gaussian number of one-sigma `sigma`.
pub fn normal(sigma: f64, rng: &mut impl Rng) -> f64 {
    sigma * rng.sample::<f64, _>(StandardNormal)
}

/// `point` with Gaussian noise of one-sigma `sigma` on each axis.
pub fn noisy_point(point: &Vector3<f64>, sigma: f64, rng: &mut impl Rng) -> Vector3<f64> {
    point + Vector3::from_fn(|_, _| normal(sigma, rng))
}

/// 64-bit FNV-1a (Fowler, Noll, Vo): the same on every machine and in every release, which `std`'s hashers do not guarantee.
pub fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn first(seed: u64, trial: u64, source: &str) -> u64 {
        Streams { seed, trial }.stream(source).random()
    }

    /// Published test vectors of 64-bit FNV-1a.
    #[test]
    fn the_hash_is_fnv1a() {
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn a_stream_depends_on_its_three_names_and_on_nothing_else() {
        let alone = first(5, 17, "tracker");
        for trial in 0..17 {
            let mut earlier = Streams { seed: 5, trial }.stream("tracker");
            let _: [u64; 9] = earlier.random();
        }
        let _ = first(5, 17, "a source added later");
        assert_eq!(first(5, 17, "tracker"), alone);
    }

    #[test]
    fn streams_differ_in_seed_trial_and_source() {
        let mut seen = BTreeSet::new();
        for seed in 0..10 {
            for trial in 0..10 {
                for source in ["arm", "plunger1", "plunger2", "plunger3", "tracker"] {
                    seen.insert(first(seed, trial, source));
                }
            }
        }
        // 500 draws of 64 bits collide by chance once in 10^14.
        assert_eq!(seen.len(), 500);
    }

    /// Recorded values: a study must give the same bytes in years to come.
    #[test]
    fn the_bytes_of_a_stream_never_change() {
        assert_eq!(first(1, 0, "arm"), 14_411_665_675_684_710_182);
        assert_eq!(first(1, 17, "tracker"), 14_096_606_211_641_915_765);
    }
}
