//! Fleets: the mean of every parameter over robots of one type, and its spread from robot to robot, as the prior of the next
//! robot of that type.
//!
//! Estimates `x_k` of a parameter's deviation from nominal, with standard uncertainties `s_k`, are taken as
//! `x_k ~ N(mean, between² + s_k²)`: what the robots vary is what their estimates vary less what the estimates are uncertain (random
//! effects; DerSimonian & Laird 1986, by restricted likelihood). Few robots say little of a variation, so its logarithm has a prior about
//! the plausible size of the catalogue; with many robots that prior does not count. What is written down is the distribution of the
//! next robot: the uncertainty of mean and variation is in its sigma.

pub use super::fleet_prior::{Fleet, FleetParameter, FleetPrior};

mod estimate;
mod file;
mod judged;

use thiserror::Error;

use self::estimate::{Between, between};
pub use self::file::{read_fleet, write_fleet};
pub use self::judged::{CONFLICT, FleetJudged, PriorUsed, identify_with_fleet};
use super::calibration::Calibration;
use super::fleet_prior::geometry;
use crate::effects::{self, Owner, ParameterSpec, Subject};

/// The reason why calibrations make no fleet.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum FleetError {
    /// One robot says nothing of others.
    #[error("there is one robot; a fleet has two or more")]
    OneRobot,
    /// A calibration of another type.
    #[error("{name} is of '{robot}', the first is of '{first}': another type; leave it out")]
    OtherType {
        /// The calibration.
        name: String,
        /// Its robot.
        robot: String,
        /// The robot of the first.
        first: String,
    },
    /// Two calibrations are of the same measurements.
    #[error("{name} is of the same measurements as {other}: one robot counts once; leave it out")]
    SameRobot {
        /// The calibration.
        name: String,
        /// Name of the calibration of the same measurements.
        other: String,
    },
    /// A calibration that repeats what a fleet said.
    #[error(
        "{name} was identified with the prior of a fleet of {robots} robots, which it repeats; identify it without --fleet, from its data alone, or leave it out"
    )]
    OfFleet {
        /// The calibration.
        name: String,
        /// Number of robots of that fleet.
        robots: usize,
    },
    /// A fit that did not converge.
    #[error("{name}: its fit {outcome}; identify it again or leave it out")]
    Unconverged {
        /// The calibration.
        name: String,
        /// Outcome of its fit.
        outcome: &'static str,
    },
    /// Nothing in common.
    #[error("no parameter of the arm is estimated in two of them; identify all with one model")]
    NothingInCommon,
}

impl Fleet {
    /// The fleet of these calibrations, each of a robot of its own.
    ///
    /// # Errors
    /// When they are not of one type, or are not usable.
    pub fn of(calibrations: &[(&str, &Calibration)]) -> Result<Fleet, FleetError> {
        let [(_, first), ..] = calibrations else { return Err(FleetError::OneRobot) };
        for (k, (name, c)) in calibrations.iter().enumerate() {
            if !c.robot.is_same_arm(&first.robot) {
                let (robot, first) = (c.robot.name.clone(), first.robot.name.clone());
                return Err(FleetError::OtherType { name: (*name).into(), robot, first });
            }
            if let Some(outcome) = c.unconverged() {
                return Err(FleetError::Unconverged { name: (*name).into(), outcome: outcome.in_words() });
            }
            if let Some(robots) = c.fleet_robots {
                return Err(FleetError::OfFleet { name: (*name).into(), robots });
            }
            let same = |(_, other): &&(&str, &Calibration)| {
                let one_dataset = c.dataset_hashes.iter().any(|h| !h.is_empty() && other.dataset_hashes.contains(h));
                one_dataset || c.fitted_rows.meets(&other.fitted_rows)
            };
            if let Some((other, _)) = calibrations[..k].iter().find(same) {
                return Err(FleetError::SameRobot { name: (*name).into(), other: (*other).into() });
            }
        }
        if calibrations.len() < 2 {
            return Err(FleetError::OneRobot);
        }
        let mut names: Vec<(&str, &str)> = Vec::new();
        for (_, c) in calibrations {
            for e in c.estimates.iter().filter(|e| !e.name.contains('@')) {
                if !names.contains(&(&e.name, &e.effect)) {
                    names.push((&e.name, &e.effect));
                }
            }
        }
        let pooled = |(name, effect): &(&str, &str)| parameter(calibrations, name, effect);
        let parameters: Vec<FleetParameter> = names.iter().filter_map(pooled).collect();
        if parameters.is_empty() {
            return Err(FleetError::NothingInCommon);
        }
        Ok(Fleet { robot: first.robot.name.clone(), geometry: geometry(&first.robot), robots: calibrations.len(), parameters })
    }
}

/// Spread between robots of one type that are very much alike, as a share of the plausible sizes of the catalogue
/// (docs/fleets.md).
const ALIKE: f64 = 0.1;

/// Probability that two robots of a fleet with this spread are reported as one robot (docs/fleets.md).
const MISTAKEN: f64 = 1e-3;

/// Two calibrations that seem to be of one robot, which was measured twice.
#[derive(Debug, Clone, PartialEq)]
pub struct SeemOne {
    /// The later calibration.
    pub name: String,
    /// The earlier one.
    pub other: String,
    /// Difference of their parameters, in units of its standard uncertainty, rms.
    pub differ: f64,
    /// That of two robots that are very much alike: they differ by a tenth of the plausible sizes of the catalogue.
    pub alike: f64,
}

impl SeemOne {
    /// The pairs of calibrations that seem to be of one robot.
    ///
    /// Their estimates are compared as if they were independent. Of robots that differ by [`SeemOne::alike`] or more, none are named in
    /// 999 of 1,000 fleets; robots that differ by less may be.
    pub fn of(calibrations: &[(&str, &Calibration)]) -> Vec<SeemOne> {
        let pairs = (calibrations.len() * calibrations.len().saturating_sub(1) / 2) as f64;
        let later = |(k, (name, c)): (usize, &(&str, &Calibration))| {
            let seem = |(other, before): &(&str, &Calibration)| {
                let [differ, alike] = measured_twice(c, before, pairs / MISTAKEN)?;
                Some(SeemOne { name: (*name).into(), other: (*other).into(), differ, alike })
            };
            calibrations[..k].iter().find_map(seem)
        };
        calibrations.iter().enumerate().filter_map(later).collect()
    }
}

/// If two calibrations seem to be of one robot: the difference of their parameters in units of its uncertainty, rms, and that of two
/// robots that are very much alike; `likely` is the likelihood ratio that is requested.
fn measured_twice(one: &Calibration, other: &Calibration, likely: f64) -> Option<[f64; 2]> {
    let (mut squares, mut count, mut ln_ratio) = ([0.0; 2], 0.0, 0.0);
    for a in one.estimates.iter().filter(|e| !e.name.contains('@') && e.stated_sigma.is_none()) {
        let Some(b) = other.estimates.iter().find(|b| b.name == a.name && b.effect == a.effect) else { continue };
        let Some(spec) = spec_of_arm(one, &a.effect, &a.name) else { continue };
        let sigma = a.sigma.hypot(b.sigma);
        let [differ, alike] = [a.value - b.value, ALIKE * spec.prior * f64::sqrt(2.0)].map(|by| (by / sigma).powi(2));
        ln_ratio += 0.5 * ((1.0 + alike).ln() - differ * alike / (1.0 + alike));
        squares = [squares[0] + differ, squares[1] + 1.0 + alike];
        count += 1.0;
    }
    (ln_ratio > likely.ln()).then(|| squares.map(|sum| (sum / count).sqrt()))
}

/// A parameter of the arm; `None` if it is not of the arm.
fn spec_of_arm(calibration: &Calibration, effect: &str, name: &str) -> Option<ParameterSpec> {
    let model = &calibration.model;
    let subject = Subject {
        own: &model.own,
        registry: &model.registry,
        field: model.field.as_ref(),
        ..Subject::new(&calibration.robot, &[])
    };
    let built = effects::build(effect, &subject).ok()?;
    if built.owner() != Owner::Robot || is_of_a_day(calibration, effect) {
        return None;
    }
    built.parameters().iter().find(|spec| spec.name == name).cloned()
}

/// A parameter of the arm, from all calibrations that estimate it; `None` if fewer than two do, or it is not of the arm.
fn parameter(calibrations: &[(&str, &Calibration)], name: &str, effect: &str) -> Option<FleetParameter> {
    let (_, c) = calibrations.iter().find(|(_, c)| c.model.effects.iter().any(|e| e == effect))?;
    let spec = spec_of_arm(c, effect, name)?;
    let estimates = calibrations.iter().filter_map(|(_, c)| c.estimates.iter().find(|e| e.name == name && e.effect == effect));
    let seen: Vec<[f64; 2]> = estimates.map(|e| [e.value - e.nominal, e.sigma]).collect();
    if seen.len() < 2 {
        return None;
    }
    let Between { mean, sigma, between } = between(&seen, spec.prior);
    let robots = seen.len();
    Some(FleetParameter {
        name: name.into(),
        effect: effect.into(),
        unit: spec.unit,
        mean,
        sigma,
        between,
        plausible: spec.prior,
        robots,
    })
}

/// True if an effect is of the day on which it was measured, not of the robot: of a time, a temperature or a sample.
fn is_of_a_day(calibration: &Calibration, effect: &str) -> bool {
    use crate::effects::facts::Follows;
    use crate::effects::family::{Origin, Scan};
    calibration.model.family(effect).is_some_and(|family| {
        let of_time = family.follows.iter().any(|f| matches!(f, Follows::Time | Follows::Temperature));
        family.origin != Origin::Arm || of_time || matches!(family.scan, Scan::Time | Scan::Sample)
    })
}
