//! Implausible corrections in an identified model.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use crate::effects::EffectId;
use crate::effects::{self, Subject};
use crate::identify::calibration::{Calibration, Estimate};
use crate::math::positive_definite::inverse;
use crate::residuals::noise::beyond_noise;
use crate::robot::{JointKind, Robot};
use crate::units::Unit;

use super::expected::{REACH_OF_CATALOGUE, reach};

/// A link correction of more than this many plausible sizes is a mistake in the data, not geometry: 10 deg, or 60 mm on
/// an arm with a reach of 0.7 m.
const MOST_SIZES: f64 = 200.0;
/// Number of standard deviations by which it must exceed that size.
const SIGMAS: f64 = 3.0;

/// A correction of implausible size.
#[derive(Debug, Clone, PartialEq)]
pub struct Unbelievable {
    /// Name of the parameter.
    pub parameter: String,
    /// Deviation from nominal, SI.
    pub deviation: f64,
    /// Absolute deviation in plausible sizes of this robot.
    pub sizes: f64,
    /// Unit in which it is shown.
    pub unit: Unit,
}

/// Lists corrections of the links' geometry that no real arm has, largest first: the model has absorbed the data
/// instead of explaining them.
///
/// Directions that the data hardly determine may deviate far, so a correction counts only if it exceeds the limit by
/// three standard deviations.
pub fn unbelievable(calibration: &Calibration) -> Vec<Unbelievable> {
    let subject = Subject::new(&calibration.robot, &[]);
    let Ok(mdh) = effects::build(EffectId::MDH, &subject) else { return Vec::new() };
    let lengths = (reach(&calibration.robot) / REACH_OF_CATALOGUE).max(1.0);
    let judge = |e: &Estimate| {
        let spec = mdh.parameters().iter().find(|p| p.name == e.name)?;
        let size = if spec.unit == Unit::MM { spec.prior * lengths } else { spec.prior };
        let deviation = e.value - e.nominal;
        let beyond = deviation.abs() - SIGMAS * e.sigma > MOST_SIZES * size;
        let (parameter, sizes) = (e.name.clone(), deviation.abs() / size);
        beyond.then_some(Unbelievable { parameter, deviation, sizes, unit: e.unit })
    };
    let mut all: Vec<Unbelievable> =
        calibration.estimates.iter().filter(|e| e.effect == EffectId::MDH).filter_map(judge).collect();
    all.sort_by(|a, b| b.sizes.total_cmp(&a.sizes));
    all
}

/// A zero of a joint that is off by more than this many plausible sizes was lost: 0.35 deg. It is estimated beside the
/// plausible sizes of all other parameters, which a few samples tell far better than it alone.
const LOST_ZERO: f64 = 7.0;
/// Chance at which a good arm shows such a zero, of all its joints.
const LOST_BY_CHANCE: f64 = 1e-5;
/// A length or a twist is abnormal beyond this many plausible sizes.
const ABNORMAL: f64 = 10.0;
/// It must be known to this many standard deviations.
const WELL_KNOWN: f64 = 10.0;

/// A parameter of the links far from what arms of its kind show: believable, and the first thing to be put right.
#[derive(Debug, Clone, PartialEq)]
pub struct Abnormal {
    /// Name of the parameter.
    pub parameter: String,
    /// The joint whose zero it is, counted from 1; `None` for a length or a twist.
    pub zero_of: Option<usize>,
    /// Deviation from nominal, SI; of a zero, by which the joint is farther than its controller says.
    pub deviation: f64,
    /// One-sigma of it, SI.
    pub sigma: f64,
    /// Absolute deviation in plausible sizes of this robot.
    pub sizes: f64,
    /// Unit in which it is shown.
    pub unit: Unit,
}

/// Lists the abnormal parameters of the links, zeros before others and each largest first; none of a fit that did not converge,
/// or that leaves far more than the stated noise.
///
/// Zeros are judged by generalised least squares: on a good arm the estimates scatter by their covariance and by what links and
/// gears of the kind show, and a zero that was lost adds to that in one direction. They are taken one after the other as long
/// as chance does not explain the next.
pub fn abnormal(calibration: &Calibration) -> Vec<Abnormal> {
    // What is left is far beyond the noise: whatever it is, it bends the zeros by more than they say.
    let is_fitted = !calibration.noise_stated || beyond_noise(calibration.chi2_per_dof).is_none();
    if calibration.unconverged().is_some() || !is_fitted {
        return Vec::new();
    }
    let sized = Estimates::of(calibration);
    let mut all = sized.lost_zeros();
    let zeros: Vec<String> = all.iter().map(|a| a.parameter.clone()).collect();
    let of_links = sized.estimates.iter().filter(|e| e.of.effect == EffectId::MDH && !zeros.contains(&e.of.name));
    all.extend(of_links.filter_map(|e| {
        let deviation = e.of.value - e.of.nominal;
        let is_abnormal = deviation.abs() > ABNORMAL * e.size && deviation.abs() > WELL_KNOWN * e.of.sigma;
        is_abnormal.then(|| e.abnormal(deviation, e.of.sigma))
    }));
    all.sort_by(|a, b| b.zero_of.is_some().cmp(&a.zero_of.is_some()).then(b.sizes.total_cmp(&a.sizes)));
    all
}

/// An estimate of links or gears, with what arms of the kind show.
struct SizedEstimate<'a> {
    of: &'a Estimate,
    /// Plausible size, SI.
    size: f64,
    zero_of: Option<usize>,
}

impl SizedEstimate<'_> {
    fn abnormal(&self, deviation: f64, sigma: f64) -> Abnormal {
        let sizes = deviation.abs() / self.size;
        Abnormal { parameter: self.of.name.clone(), zero_of: self.zero_of, deviation, sigma, sizes, unit: self.of.unit }
    }
}

/// The freely fitted estimates of links and gears, and their covariance, whatever the others are.
struct Estimates<'a> {
    estimates: Vec<SizedEstimate<'a>>,
    /// In plausible sizes.
    covariance: DMatrix<f64>,
    /// Degrees of freedom from which its scale is known; infinite if the noise is stated.
    dof: f64,
}

impl<'a> Estimates<'a> {
    fn of(calibration: &'a Calibration) -> Self {
        let robot = &calibration.robot;
        let lengths = (reach(robot) / REACH_OF_CATALOGUE).max(1.0);
        let subject = Subject::new(robot, &[]);
        let built = [EffectId::MDH, EffectId::JOINT_COMPLIANCE].map(|id| effects::build(id, &subject));
        let specs: Vec<_> = built.iter().flatten().flat_map(|effect| effect.parameters()).collect();
        let sized = |(k, of): (usize, &'a Estimate)| {
            let is_free = calibration.model.width_of(&of.effect).is_infinite();
            let spec = specs.iter().find(|spec| is_free && spec.name == of.name)?;
            let size = if spec.unit == Unit::MM { spec.prior * lengths } else { spec.prior };
            Some((k, SizedEstimate { of, size, zero_of: zero_of(robot, &of.name) }))
        };
        let (places, estimates): (Vec<usize>, Vec<SizedEstimate<'_>>) =
            calibration.estimates.iter().enumerate().filter_map(sized).unzip();
        let in_sizes = |k: usize| estimates[k].of.sigma / estimates[k].size;
        let covariance = DMatrix::from_fn(places.len(), places.len(), |r, c| {
            calibration.correlation[(places[r], places[c])] * in_sizes(r) * in_sizes(c)
        });
        let dof = if calibration.noise_stated { f64::INFINITY } else { calibration.dof as f64 };
        Estimates { estimates, covariance, dof }
    }

    /// The zeros that are lost, in the order in which they were found.
    fn lost_zeros(&self) -> Vec<Abnormal> {
        let n = self.estimates.len();
        let deviations = DVector::from_iterator(n, self.estimates.iter().map(|e| (e.of.value - e.of.nominal) / e.size));
        let spread = &self.covariance + DMatrix::identity(n, n);
        // A covariance that cannot be inverted tells nothing of any zero.
        let Ok(weights) = inverse(spread) else { return Vec::new() };
        let zeros: Vec<usize> = (0..n).filter(|&k| self.estimates[k].zero_of.is_some()).collect();
        let mut lost: Vec<usize> = Vec::new();
        loop {
            // What the zeros found so far leave of the weights.
            let columns = weights.select_columns(&lost);
            let own = columns.select_rows(&lost);
            let Ok(covariance) = inverse(own) else { return Vec::new() };
            let left = &weights - &columns * &covariance * columns.transpose();
            let pulls = &left * &deviations;
            let score = |&k: &usize| pulls[k].abs() / left[(k, k)].max(f64::MIN_POSITIVE).sqrt();
            let open = zeros.iter().copied().filter(|k| !lost.contains(k) && left[(*k, *k)] > 1e-9);
            let next = open.max_by(|a, b| score(a).total_cmp(&score(b)));
            let next = next.filter(|k| {
                let size = pulls[*k].abs() / left[(*k, *k)];
                size > LOST_ZERO && self.chance(score(k)) * (zeros.len() as f64) < LOST_BY_CHANCE
            });
            if let Some(next) = next {
                lost.push(next);
                continue;
            }
            let sizes = &covariance * columns.transpose() * &deviations;
            let abnormal = lost.iter().enumerate().map(|(k, &of)| {
                let e = &self.estimates[of];
                // Its own ordinary part is a part of it.
                let sigma = (covariance[(k, k)] - 1.0).max(0.0).sqrt();
                e.abnormal(sizes[k] * e.size, sigma * e.size)
            });
            // One that another has taken up again is none.
            return abnormal.filter(|a| a.sizes > LOST_ZERO).collect();
        }
    }

    /// Probability of so large a deviation in standard deviations.
    fn chance(&self, score: f64) -> f64 {
        match StudentsT::new(0.0, 1.0, self.dof.max(1.0)) {
            Ok(law) if self.dof.is_finite() => 2.0 * law.sf(score),
            _ => Normal::standard().sf(score) * 2.0,
        }
    }
}

/// The joint whose zero this parameter is, counted from 1.
fn zero_of(robot: &Robot, name: &str) -> Option<usize> {
    let kinds = [("theta", JointKind::Revolute), ("d", JointKind::Prismatic)];
    kinds.into_iter().find_map(|(prefix, kind)| {
        let joint = name.strip_prefix(prefix)?.parse::<usize>().ok()?;
        ((1..=robot.joints()).contains(&joint) && robot.kind(joint - 1) == kind).then_some(joint)
    })
}
