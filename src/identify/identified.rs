//! From datasets and a model to a calibration that predicts what its fit left.

use super::{Calibration, IdentifyError, Model, Problem, Use, covariance_with_model_error, fit};
use crate::measure::Dataset;
use crate::units::MM;

/// Share of the residual by which a calibration as read back may differ.
const REPRODUCED: f64 = 1e-6;

/// Residuals below this, m, are rounding.
const ROUNDING: f64 = 1e-12;

/// Identifies the robot from the rows of set `fit` of named datasets.
///
/// # Errors
/// When data and model do not fit together, or do not determine the unknowns.
pub fn identify(datasets: &[(&str, &Dataset)], model: &Model) -> Result<Calibration, IdentifyError> {
    let problem = Problem::new(datasets, model, Use::Fit)?;
    let fit = fit(&problem)?;
    let covariance = covariance_with_model_error(&problem, &fit)?;
    let calibration = Calibration::with_covariance(datasets, model, &problem, &fit, &covariance);
    calibration.check_residual(datasets, &calibration)?;
    Ok(calibration)
}

impl Calibration {
    /// That the calibration `read` back from its file leaves the residual of this one on the rows of set `fit`.
    ///
    /// # Errors
    /// [`IdentifyError::Inconsistent`]; as [`Calibration::predict`].
    pub fn check_residual(&self, datasets: &[(&str, &Dataset)], read: &Calibration) -> Result<(), IdentifyError> {
        let residuals = read.predict(datasets, Use::Fit)?.residuals;
        let rms = (residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / residuals.len().max(1) as f64).sqrt();
        if (rms - self.rms).abs() <= REPRODUCED * self.rms + ROUNDING {
            return Ok(());
        }
        Err(IdentifyError::Inconsistent { fitted_mm: self.rms / MM, read_mm: rms / MM })
    }
}
