//! Implausible corrections in an identified model.

use crate::effects::EffectId;
use crate::effects::{self, Subject};
use crate::identify::calibration::{Calibration, Estimate};
use crate::robot::JointKind;
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

/// A zero of a joint that is off by more than this many plausible sizes was lost: 0.4 deg.
const LOST_ZERO: f64 = 8.0;
/// A length or a twist is abnormal beyond this many.
const ABNORMAL: f64 = 10.0;
/// Either must be known to this many standard deviations.
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

/// Lists the abnormal parameters of the links, zeros before others and each largest first; none of a fit that did not converge.
pub fn abnormal(calibration: &Calibration) -> Vec<Abnormal> {
    if calibration.unconverged().is_some() {
        return Vec::new();
    }
    let robot = &calibration.robot;
    let Ok(mdh) = effects::build(EffectId::MDH, &Subject::new(robot, &[])) else { return Vec::new() };
    let lengths = (reach(robot) / REACH_OF_CATALOGUE).max(1.0);
    let zero_of = |name: &str| {
        let (prefixes, kinds) = (["theta", "d"], [JointKind::Revolute, JointKind::Prismatic]);
        let number = |prefix: &str| name.strip_prefix(prefix)?.parse::<usize>().ok();
        prefixes
            .iter()
            .zip(kinds)
            .find_map(|(prefix, kind)| number(prefix).filter(|n| (1..=robot.joints()).contains(n) && robot.kind(n - 1) == kind))
    };
    let judge = |e: &Estimate| {
        let spec = mdh.parameters().iter().find(|p| p.name == e.name)?;
        let size = if spec.unit == Unit::MM { spec.prior * lengths } else { spec.prior };
        let deviation = e.value - e.nominal;
        let (sizes, zero_of) = (deviation.abs() / size, zero_of(&e.name));
        let most = if zero_of.is_some() { LOST_ZERO } else { ABNORMAL };
        let is_abnormal = sizes > most && deviation.abs() > WELL_KNOWN * e.sigma;
        let (parameter, sigma, unit) = (e.name.clone(), e.sigma, e.unit);
        is_abnormal.then_some(Abnormal { parameter, zero_of, deviation, sigma, sizes, unit })
    };
    let of_links = calibration.estimates.iter().filter(|e| e.effect == EffectId::MDH);
    let mut all: Vec<Abnormal> = of_links.filter_map(judge).collect();
    all.sort_by(|a, b| b.zero_of.is_some().cmp(&a.zero_of.is_some()).then(b.sizes.total_cmp(&a.sizes)));
    all
}
