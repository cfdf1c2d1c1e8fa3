//! Power of a check: changes that it would show, before anything is measured, and that it would have shown.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::conditions::{Columns, Condition, of_samples};
use super::evidence::Evidence;
use super::noise::Whitening;
use super::scene::Scene;
use super::seen::{Seen, ends};
use super::{CHANGED_BEFOREHAND, CheckError};
use crate::identify::calibration::Calibration;
use crate::math::positive_definite::ScaledCholesky;
use crate::measure::dataset::NamedDataset;
use crate::robot::{JointKind, Robot};

/// Checks simulated for each condition and size.
const TRIALS: usize = 400;

/// Probability with which a check shows what it is said to show (docs/check.md).
pub const SHOWN: f64 = 0.95;

/// Checks simulated for each size that may be the smallest shown.
const SHOWN_TRIALS: usize = 100;
/// Number of them that may miss it: the share that [`SHOWN`] leaves.
const SHOWN_MISSES: usize = 5;

/// Sizes from which the smallest one shown is searched for, in units of the noise.
const SHOWN_FROM: [f64; 2] = [0.5, 8.0];
/// Largest size that is tried, in units of the noise.
const SHOWN_UP_TO: f64 = 2000.0;

/// Halvings of the interval in which the smallest size shown lies: to two per cent.
const HALVINGS: usize = 7;

/// A direction of a condition that displaces the samples by less than this share of its largest is not shown.
const NOT_SHOWN: f64 = 1e-6;

/// Largest change for which a check is designed, m, rad or as a share: beyond it, the samples do not show the change.
const LARGEST_CHANGE: f64 = 0.2;
/// The same for a mass, kg.
const LARGEST_MASS: f64 = 1000.0;

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

/// Unit of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// m.
    Length,
    /// rad.
    Angle,
    /// rad/(N m), or m/N of a sliding joint.
    Compliance,
    /// kg.
    Mass,
    /// A share of the whole.
    Share,
}

/// The size of a change.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangeSize {
    /// Unit of its components.
    pub quantity: Quantity,
    /// One number; or three along x, y and z, of the flange for a tool or a target, of the world for a base or a ball.
    pub components: Vec<SizeComponent>,
}

/// A number of a change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeComponent {
    /// The number, SI.
    pub value: f64,
    /// One-sigma: of the noise, or of what the change leaves if that is more; of a load also what its proportions leave open.
    pub sigma: f64,
}

/// Unit of the change of a condition; `None` if it has no size.
fn quantity_of(condition: &Condition, robot: &Robot) -> Option<Quantity> {
    Some(match condition {
        Condition::Valid | Condition::SingleSample(_) | Condition::Recalibrate => return None,
        Condition::JointSlipped(joint) | Condition::LostMotion(joint) if robot.kind(joint - 1) == JointKind::Revolute => {
            Quantity::Angle
        }
        Condition::GearGivesWay(_) => Quantity::Compliance,
        Condition::Warm => Quantity::Share,
        Condition::OtherPayload => Quantity::Mass,
        _ => Quantity::Length,
    })
}

/// The size of a condition by the first differences (whitened), one of unit variance a row; `None` if it has none, or these do
/// not show it.
pub(super) fn size_of(columns: &Columns, differences: &DVector<f64>, robot: &Robot) -> Option<ChangeSize> {
    let quantity = quantity_of(&columns.condition, robot)?;
    let end = differences.nrows().min(columns.first + columns.block.nrows());
    let rows = end.checked_sub(columns.first)?;
    let block = columns.block.rows(0, rows);
    let mut factor = ScaledCholesky::of(&block.tr_mul(&block)).ok()?;
    let mut size = block.tr_mul(&differences.rows(columns.first, rows));
    factor.solve_in_place(&mut size);
    let covariance = factor.inverse();
    // A ball that moved leaves the arm at its old place by as much the other way.
    let sign = if matches!(columns.condition, Condition::BallMoved(_)) { -1.0 } else { 1.0 };
    // What it leaves beyond the noise is off its columns, and so is its size.
    let left = (differences.rows(columns.first, rows) - block * &size).norm_squared();
    let excess = (left / rows.saturating_sub(size.nrows()).max(1) as f64).sqrt().max(1.0);
    // A load is off in all rows alike.
    let alike = if columns.condition.is_of_load() { columns.condition.in_shape() } else { 0.0 };
    let component =
        |k: usize| SizeComponent { value: sign * size[k], sigma: (excess * covariance[(k, k)].sqrt()).hypot(alike * size[k]) };
    // Rotations of the base, which come after its translations, are in other units.
    Some(ChangeSize { quantity, components: (0..size.nrows().min(3)).map(component).collect() })
}

/// The smallest change of one condition that the samples of a check show.
#[derive(Debug, Clone, PartialEq)]
pub struct SmallestDetectable {
    /// The condition.
    pub condition: Condition,
    /// Unit of its change.
    pub quantity: Quantity,
    /// The smallest change that is shown with a probability of [`SHOWN`]; `None` if these samples do not show it in every
    /// direction.
    pub smallest: Option<Smallest>,
}

/// A change that the samples of a check show.
#[derive(Debug, Clone, PartialEq)]
pub struct Smallest {
    /// The change in the direction in which it shows least, SI; of the base, its translation.
    pub change: f64,
    /// The same in units of the noise, and how often it is found and named when all samples are used.
    pub at: PowerAt,
}

/// The smallest change of every condition that has a size, at the samples of a check and under their noise; `columns` are those
/// of the evidence.
pub(super) fn shown(columns: &[Columns], evidence: &Evidence, robot: &Robot) -> Vec<SmallestDetectable> {
    let of = |(index, Columns { condition, block, .. }): (usize, &Columns)| {
        let quantity = quantity_of(condition, robot)?;
        // Rotations of the base, which come after its translations, are in other units.
        let matrix = block.columns(0, block.ncols().min(3)).into_owned();
        let smallest = least_seen(&matrix).and_then(|displaced| smallest(evidence, index, &displaced));
        let largest = if quantity == Quantity::Mass { LARGEST_MASS } else { LARGEST_CHANGE };
        Some(SmallestDetectable { condition: condition.clone(), quantity, smallest: smallest.filter(|s| s.change <= largest) })
    };
    columns.iter().enumerate().filter_map(of).collect()
}

/// The displacement by a change of unit size in the direction in which it displaces least; `None` if it does not displace there.
fn least_seen(matrix: &DMatrix<f64>) -> Option<DVector<f64>> {
    if matrix.is_empty() {
        return None;
    }
    let gram = matrix.tr_mul(matrix).symmetric_eigen();
    let (least, _) = gram.eigenvalues.argmin();
    let displaced = matrix * gram.eigenvectors.column(least);
    let largest = gram.eigenvalues.max().max(0.0).sqrt();
    (displaced.norm() > NOT_SHOWN * largest).then_some(displaced)
}

/// The smallest change along a displacement that the check finds often enough.
fn smallest(evidence: &Evidence, index: usize, displaced: &DVector<f64>) -> Option<Smallest> {
    let rows = (displaced.nrows() as f64).sqrt();
    let unit = displaced.normalize() * rows;
    let trial = |random: &mut ChaCha8Rng, size: f64| {
        DVector::from_fn(unit.nrows(), |i, _| Distribution::<f64>::sample(&StandardNormal, random) + size * unit[i])
    };
    // The same noise for every size, so that the larger one is found more often.
    let random = || ChaCha8Rng::seed_from_u64(1 + index as u64);
    let is_shown = |size: f64| {
        let mut random = random();
        let misses = (0..SHOWN_TRIALS).filter(|_| !evidence.is_reported(index, &trial(&mut random, size)));
        misses.take(SHOWN_MISSES + 1).count() <= SHOWN_MISSES
    };
    let [mut below, mut above] = SHOWN_FROM;
    while !is_shown(above) {
        (below, above) = (above, 4.0 * above);
        if above > SHOWN_UP_TO {
            return None;
        }
    }
    for _ in 0..HALVINGS {
        let middle = (below * above).sqrt();
        if is_shown(middle) {
            above = middle;
        } else {
            below = middle;
        }
    }
    let condition = evidence.condition(index);
    let (mut random, all) = (random(), evidence.samples());
    let (mut found, mut named) = (0, 0);
    for _ in 0..SHOWN_TRIALS {
        let differences = trial(&mut random, above);
        if evidence.is_reported(index, &differences) {
            found += 1;
            named += usize::from(is_named(evidence, condition, &differences, all));
        }
    }
    let share = |count: usize| count as f64 / SHOWN_TRIALS as f64;
    let at = PowerAt { size: above, found: share(found), named: share(named), samples: all as f64 };
    Some(Smallest { change: above * rows / displaced.norm(), at })
}

/// True if the first `samples` name a condition, or one that they cannot distinguish from it.
fn is_named(evidence: &Evidence, condition: &Condition, differences: &DVector<f64>, samples: usize) -> bool {
    let judged = evidence.probabilities(differences, samples, CHANGED_BEFOREHAND);
    let first = judged.iter().map(|j| &j.condition).find(|c| **c != Condition::Valid);
    first.is_some_and(|first| first == condition || evidence.aliased_with(first, differences, samples).contains(condition))
}

/// Simulates checks that measure these samples of the campaign again, in this order, for every condition at each of `sizes`;
/// the first entry is "valid", whose share found is that of false alarms.
///
/// # Errors
/// When the campaign does not belong to the calibration, or its noise is not stated.
pub fn power_of_check(
    calibration: &Calibration,
    campaign: NamedDataset<'_>,
    samples: &[usize],
    sizes: &[f64],
) -> Result<Vec<Power>, CheckError> {
    let all = Scene::of_campaign(calibration, campaign)?;
    let seen: Vec<&Seen> = samples.iter().filter_map(|&k| all.get(k)).collect();
    if seen.is_empty() {
        return Err(CheckError::Nothing);
    }
    let ends = ends(&seen);
    let evidence = Evidence::new(&of_samples(&seen, &Whitening::of(&seen)?), ends);
    let mut powers = vec![Power { condition: Condition::Valid, at: vec![simulated(&evidence, None, 0.0)] }];
    for index in 0..evidence.count() {
        let condition = evidence.condition(index);
        let at = sizes.iter().map(|&size| simulated(&evidence, Some(index), size)).collect();
        powers.push(Power { condition: condition.clone(), at });
    }
    Ok(powers)
}

fn simulated(evidence: &Evidence, injected: Option<usize>, size: f64) -> PowerAt {
    let mut random = ChaCha8Rng::seed_from_u64(injected.map_or(0, |k| 1 + k as u64));
    let mut normal = |n: usize| DVector::from_fn(n, |_, _| Distribution::<f64>::sample(&StandardNormal, &mut random));
    let (mut found, mut named, mut taken) = (0, 0, 0);
    let rows = evidence.rows();
    for _ in 0..TRIALS {
        let mut differences = normal(rows);
        if let Some(index) = injected {
            let direction = normal(evidence.directions(index)).normalize();
            differences += evidence.displaced(index, &direction) * (size * (rows as f64).sqrt());
        }
        let (at, true) = evidence.decide(&differences) else { continue };
        found += 1;
        taken += at;
        let condition = injected.map(|index| evidence.condition(index));
        named += usize::from(condition.is_some_and(|condition| is_named(evidence, condition, &differences, at)));
    }
    let share = |count: usize| count as f64 / TRIALS as f64;
    PowerAt { size, found: share(found), named: share(named), samples: taken as f64 / found.max(1) as f64 }
}
