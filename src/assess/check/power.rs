//! What a check would show, before anything is measured.

use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::conditions::{Condition, of_samples};
use super::evidence::Evidence;
use super::noise::Whitening;
use super::scene::Scene;
use super::seen::{Seen, ends};
use super::{CHANGED_BEFOREHAND, CheckError};
use crate::identify::Calibration;
use crate::measure::Dataset;

/// Checks simulated for each condition and size.
const TRIALS: usize = 400;

/// A condition of a size, and how often a check finds it.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerAt {
    /// Root mean square displacement over the samples of the check, in units of the noise of one comparison.
    pub size: f64,
    /// Share of checks that report a change.
    pub found: f64,
    /// Share of checks that name this condition, or one that their poses cannot distinguish from it.
    pub named: f64,
    /// Mean number of samples until it is named.
    pub samples: f64,
}

/// Power of a check for one condition.
#[derive(Debug, Clone, PartialEq)]
pub struct Power {
    /// The condition.
    pub condition: Condition,
    /// One entry per size.
    pub at: Vec<PowerAt>,
}

/// Simulates checks that measure these samples of the campaign again, in this order, for every condition at each of `sizes`;
/// the first entry is "valid", whose share found is that of false alarms.
///
/// # Errors
/// When the campaign does not belong to the calibration, or its noise is not stated.
pub fn power_of_check(
    calibration: &Calibration,
    campaign: (&str, &Dataset),
    samples: &[usize],
    sizes: &[f64],
) -> Result<Vec<Power>, CheckError> {
    let all = Scene::of_campaign(calibration, campaign)?;
    let seen: Vec<&Seen> = samples.iter().filter_map(|&k| all.get(k)).collect();
    if seen.is_empty() {
        return Err(CheckError::Nothing);
    }
    let ends = ends(&seen);
    let evidence = Evidence::new(&of_samples(&seen, &Whitening::of(&seen)), ends);
    let mut powers = vec![Power { condition: Condition::Valid, at: vec![simulated(&evidence, None, 0.0)] }];
    for index in 0..evidence.count() {
        let (condition, _) = evidence.basis(index);
        let at = sizes.iter().map(|&size| simulated(&evidence, Some(index), size)).collect();
        powers.push(Power { condition: condition.clone(), at });
    }
    Ok(powers)
}

fn simulated(evidence: &Evidence, injected: Option<usize>, size: f64) -> PowerAt {
    let mut random = ChaCha8Rng::seed_from_u64(injected.map_or(0, |k| 1 + k as u64));
    let mut normal = |n: usize| DVector::from_fn(n, |_, _| Distribution::<f64>::sample(&StandardNormal, &mut random));
    let (mut found, mut named, mut taken) = (0, 0, 0);
    let rows = evidence.basis(0).1.nrows();
    for _ in 0..TRIALS {
        let mut differences = normal(rows);
        if let Some(index) = injected {
            let basis = evidence.basis(index).1;
            let direction = normal(basis.ncols());
            differences += basis * direction.normalize() * (size * (rows as f64).sqrt());
        }
        let (at, true) = evidence.decide(&differences) else { continue };
        found += 1;
        taken += at;
        let judged = evidence.probabilities(&differences, at, CHANGED_BEFOREHAND);
        let Some(first) = judged.iter().map(|j| &j.condition).find(|c| **c != Condition::Valid) else { continue };
        let is_it = |c: &Condition| injected.is_some_and(|index| *c == *evidence.basis(index).0);
        if is_it(first) || evidence.aliased_with(first, &differences, at).iter().any(is_it) {
            named += 1;
        }
    }
    let share = |count: usize| count as f64 / TRIALS as f64;
    PowerAt { size, found: share(found), named: share(named), samples: taken as f64 / found.max(1) as f64 }
}
