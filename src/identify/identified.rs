//! From datasets and a model to a calibration that reproduces the residual of its fit.

use super::Model;
use super::calibration::{Calibration, IdentifyError};
use super::fit::{by_own_noise, covariance_with_model_error, fit};
use super::problem::{Problem, Use};
use crate::math::rms;
use crate::measure::dataset::NamedDataset;
use crate::units::MM;

/// Relative difference of the residual allowed for a calibration as read back.
const REPRODUCED: f64 = 1e-6;

/// Residuals below this, m, are rounding.
const ROUNDING: f64 = 1e-12;

/// Identifies the robot from the rows of set `fit` of named datasets.
///
/// ```
/// use std::sync::Arc;
///
/// use calibench::identify::{Model, identify};
/// use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
/// use calibench::robot::kinematics::world_from_tool;
/// use calibench::robot::{FramePose, built_in};
/// use calibench::units::{MM, UM};
///
/// let robot = Arc::new(built_in("ur5").ok_or("built in")?);
/// let (believed, truly) = (FramePose::default(), FramePose { xyz: [2.0 * MM, 0.0, -1.0 * MM], rz_ry_rx: [0.0; 3] });
/// let sample = |k: usize| {
///     let q: Vec<f64> = (1..=6).map(|i| 2.0 * ((k * i) as f64 * 0.618).fract() - 1.0).collect();
///     let seen = world_from_tool(&robot, &truly, &FramePose::default(), &q).translation.vector;
///     Sample::new(format!("p{k}"), q, Measured::Point(seen))
/// };
/// let samples = (0..20).map(sample).collect();
/// let noise = Noise { point: Some(20.0 * UM), ..Noise::default() };
/// let data = Dataset { robot: robot.clone(), base: believed, noise, samples, ..Dataset::default() };
///
/// let calibration = identify(&[NamedDataset::new("campaign", &data)], &Model::of(&["base_frame"]))?;
/// let base_z = calibration.estimate("base_z").ok_or("fitted")?;
/// assert!((base_z.value + 1.0 * MM).abs() < base_z.sigma && base_z.sigma < 0.02 * MM);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When data and model do not match, or do not determine the unknowns.
pub fn identify(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Calibration, IdentifyError> {
    identified(datasets, model, Problem::new(datasets, model, Use::Fit)?)
}

/// The calibration of [`identify`] with its observability indices and condition number left out (NaN), for studies of many
/// campaigns of one plan.
///
/// # Errors
/// As [`identify`].
pub fn identify_without_indices(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Calibration, IdentifyError> {
    identified(datasets, model, Problem::new(datasets, model, Use::Fit)?.without_indices())
}

fn identified(datasets: &[NamedDataset<'_>], model: &Model, problem: Problem) -> Result<Calibration, IdentifyError> {
    let first = fit(&problem)?;
    let (problem, fit) = &by_own_noise(datasets, problem, first);
    let covariance = covariance_with_model_error(problem, fit)?;
    let calibration = Calibration::with_covariance(datasets, model, problem, fit, &covariance);
    match calibration.values_for(problem) {
        (values, unseen) if unseen.is_empty() => calibration.check_rms(rms(&problem.residuals(&values)))?,
        _ => calibration.check_residual(datasets, &calibration)?,
    }
    Ok(calibration)
}

impl Calibration {
    /// Checks that the calibration `read` back from its file gives the residual of this one on the rows of set `fit`.
    ///
    /// # Errors
    /// [`IdentifyError::Inconsistent`]; as [`Calibration::predict`].
    pub fn check_residual(&self, datasets: &[NamedDataset<'_>], read: &Calibration) -> Result<(), IdentifyError> {
        self.check_rms(rms(&read.predict(datasets, Use::Fit)?.residuals))
    }

    /// Checks that a residual, m, is that of this calibration.
    fn check_rms(&self, rms: f64) -> Result<(), IdentifyError> {
        if (rms - self.rms).abs() <= REPRODUCED * self.rms + ROUNDING {
            return Ok(());
        }
        Err(IdentifyError::Inconsistent { fitted_mm: self.rms / MM, read_mm: rms / MM })
    }
}
