//! Identification with a fleet as the prior, unless the robot is not like the fleet.
//!
//! The data are fitted with the fleet's prior and with the same one widened tenfold. What the narrow prior costs in chi-square has,
//! if the robot is of the fleet, a known distribution: along each direction of the parameters, in units of the prior, with
//! information `l` of the data it is `w chi²` with `w = 99 l / (1 + 100 l)`. The sum is compared by an F test with the noise that
//! the wide fit leaves (Box 1980: the prior predictive check). If it costs more than one robot in a hundred of the fleet would, the
//! fleet is not used.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::{Fleet, FleetPrior};
use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::fit::{Fit, FitError, covariance_with_model_error, fit};
use crate::identify::problem::{Prior, Problem, Use};
use crate::identify::{Model, identify};
use crate::math::linalg;
use crate::measure::dataset::NamedDataset;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// Probability that a robot of the fleet is judged not to belong to it (decision 0040).
pub const CONFLICT: f64 = 0.01;

/// Ratio of the one-sigmas of the wide prior to those of the fleet's (decision 0040).
const WIDE: f64 = 10.0;

/// Degrees of freedom that a stated noise is worth.
const STATED: f64 = 4.0;

/// Number of rounds in which the noise and the fit are estimated in turn.
const ROUNDS: usize = 3;

/// The prior that was used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PriorUsed {
    /// The fleet's.
    Fleet,
    /// None: the data determine the arm by themselves.
    None,
    /// The sizes of the catalogue about nominal, since the data alone do not determine the arm.
    Catalogue,
}

impl PriorUsed {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            PriorUsed::Fleet => "fleet",
            PriorUsed::None => "none",
            PriorUsed::Catalogue => "catalogue",
        }
    }
}

/// Agreement of a robot with its fleet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FleetJudged {
    /// The prior that was used.
    pub used: PriorUsed,
    /// Chi-square of the fleet's prior for this robot, as a ratio to its mean over robots of the fleet.
    pub ratio: f64,
    /// Probability of more if the robot is of the fleet.
    pub chance: f64,
    /// Number of directions that the data show.
    pub directions: f64,
    /// Noise of the data in units of that stated.
    pub noise: f64,
}

/// Identifies a robot with the prior of its fleet, or without if it is not like the fleet.
///
/// # Errors
/// When data and model do not match.
pub fn identify_with_fleet(
    datasets: &[NamedDataset<'_>],
    model: &Model,
    fleet: &Fleet,
) -> Result<(Calibration, FleetJudged), IdentifyError> {
    let narrow = FleetPrior::of(fleet);
    let (noise, wide) = fitted(datasets, model, &FleetPrior { widened: WIDE, ..narrow.clone() }, None)?;
    let (_, close) = fitted(datasets, model, &narrow, Some(noise))?;
    let mut judged = compared(&wide, &close, noise)?;
    if judged.chance >= CONFLICT {
        let calibration = calibrated(datasets, model, &FleetPrior { noise, ..narrow })?;
        return Ok((calibration, judged));
    }
    if let Ok(calibration) = identify(datasets, model)
        && calibration.unconverged().is_none()
    {
        judged.used = PriorUsed::None;
        return Ok((calibration, judged));
    }
    judged.used = PriorUsed::Catalogue;
    let catalogue = FleetPrior { widened: CATALOGUE, ..FleetPrior::catalogue() };
    let (noise, _) = fitted(datasets, model, &catalogue, None)?;
    Ok((calibrated(datasets, model, &FleetPrior { noise, ..catalogue })?, judged))
}

/// Factor by which the sizes of the catalogue are widened where they replace a fleet (docs/fleets.md).
const CATALOGUE: f64 = 3.0;

/// A fit with a prior.
struct Fitted {
    problem: Problem,
    fit: Fit,
    /// Sigma of the prior of each kept parameter; `None` without one.
    prior: Vec<Option<f64>>,
}

impl Fitted {
    /// Information of the data about the parameters with a prior, in units of the prior: eigenvalues.
    ///
    /// # Errors
    /// When the covariance is not finite.
    fn information(&self) -> Result<Vec<f64>, FitError> {
        let own: Vec<usize> = (0..self.prior.len()).filter(|&k| self.prior[k].is_some()).collect();
        let sigma = |k: usize| self.prior[own[k]].unwrap_or(1.0);
        // Without a stated noise the covariance is scaled by the residuals.
        let unit =
            if self.fit.noise_stated { 1.0 } else { (self.fit.chi2 / self.fit.dof.max(1) as f64).max(f64::MIN_POSITIVE) };
        let scaled =
            DMatrix::from_fn(own.len(), own.len(), |r, c| self.fit.covariance[(own[r], own[c])] / (sigma(r) * sigma(c)) / unit);
        if own.is_empty() {
            return Ok(Vec::new());
        }
        let (values, _) = linalg::symmetric_eigen(&scaled)?;
        Ok(values.iter().map(|p| (1.0 / p.max(1e-12) - 1.0).max(0.0)).collect())
    }

    /// Scalar residuals of samples less the parameters that they determine.
    ///
    /// # Errors
    /// When the covariance is not finite.
    fn freedoms(&self) -> Result<f64, FitError> {
        let flat = self.problem.parameters().iter().enumerate();
        let flat = flat.filter(|(p, q)| q.knowledge == Prior::Uninformative && self.fit.kept.binary_search(p).is_ok()).count();
        let effective: f64 = self.information()?.iter().map(|l| l / (1.0 + l)).sum();
        Ok((self.problem.row_count() - self.problem.prior_count()) as f64 - flat as f64 - effective)
    }
}

/// Fits with a prior, the noise being estimated from the residual unless it is given. Returns the noise too.
fn fitted(
    datasets: &[NamedDataset<'_>],
    model: &Model,
    prior: &FleetPrior,
    noise: Option<f64>,
) -> Result<(f64, Fitted), IdentifyError> {
    let mut now = noise.unwrap_or(1.0);
    let mut round = 0;
    loop {
        let with = Model { fleet: Some(Arc::new(FleetPrior { noise: now, ..prior.clone() })), ..model.clone() };
        let problem = Problem::new(datasets, &with, Use::Fit)?;
        let fit = fit(&problem)?;
        let of = |p: &usize| match problem.parameters()[*p].knowledge {
            Prior::Fleet(sigma) => Some(sigma / now),
            _ => None,
        };
        let fitted = Fitted { prior: fit.kept.iter().map(of).collect(), problem, fit };
        round += 1;
        if noise.is_some() || round > ROUNDS {
            return Ok((now, fitted));
        }
        let known = if fitted.fit.noise_stated { STATED } else { 0.0 };
        let variance = (fitted.fit.chi2 + known) / (fitted.freedoms()?.max(0.0) + known).max(1.0);
        // A stated noise may be too small, since models lack something; data are not better than stated.
        let least = if fitted.fit.noise_stated { 1.0 } else { 1e-6 };
        now = variance.max(least).sqrt();
    }
}

fn compared(wide: &Fitted, close: &Fitted, noise: f64) -> Result<FleetJudged, FitError> {
    let wanted = close.information()?;
    let weights: Vec<f64> = wanted.iter().map(|l| 99.0 * l / (1.0 + 100.0 * l)).collect();
    let (mean, square): (f64, f64) = (weights.iter().sum(), weights.iter().map(|w| w * w).sum());
    let costs = (close.fit.chi2 - wide.fit.chi2).max(0.0);
    let stated = if close.fit.noise_stated { STATED } else { 0.0 };
    let below = (wide.freedoms()? + stated).max(1.0);
    let ratio = if mean > 0.0 { costs / mean / (noise * noise) } else { 0.0 };
    let above = if square > 0.0 { mean * mean / square } else { 1.0 };
    let chance = FisherSnedecor::new(above, below).map_or(1.0, |f| f.sf(ratio.min(1e12)));
    Ok(FleetJudged { used: PriorUsed::Fleet, ratio, chance, directions: mean, noise })
}

/// The calibration of a fit with a prior.
fn calibrated(datasets: &[NamedDataset<'_>], model: &Model, prior: &FleetPrior) -> Result<Calibration, IdentifyError> {
    let with = Model { fleet: Some(Arc::new(prior.clone())), ..model.clone() };
    let problem = Problem::new(datasets, &with, Use::Fit)?;
    let fit = fit(&problem)?;
    let covariance = covariance_with_model_error(&problem, &fit)?;
    let fitted = Calibration::with_covariance(datasets, model, &problem, &fit, &covariance);
    let calibration = Calibration { fleet_robots: prior.fleet.as_ref().map(|fleet| fleet.robots), ..fitted };
    calibration.check_residual(datasets, &calibration)?;
    Ok(calibration)
}
