//! Prediction of measurements by a calibration, and the set-up that it used for them.

use nalgebra::Vector3;

use super::problem::Problem;

/// Predictions of the calibrated model for samples.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// Names of the samples.
    pub sample_ids: Vec<String>,
    /// Measured minus predicted, m.
    pub residuals: Vec<Vector3<f64>>,
    /// Measured minus predicted orientation, rotation vectors in the world, rad; `None` for samples that measured none.
    pub orientations: Vec<Option<Vector3<f64>>>,
    /// Parameters of unseen set-ups fitted to these samples.
    pub refitted: Vec<String>,
    /// Parameters of unseen set-ups fitted to other samples, of set `fit`.
    pub from_fit_rows: Vec<String>,
}

/// Samples laid out under a calibration.
pub struct Application {
    /// The samples.
    pub problem: Problem,
    /// Deviation of every parameter of the problem from its start, SI.
    pub values: Vec<f64>,
    /// Index of the calibration's estimate of each parameter of the problem; `None` if it has none.
    pub estimates: Vec<Option<usize>>,
    /// Parameters of unseen set-ups fitted to these samples.
    pub refitted: Vec<usize>,
    /// Parameters of unseen set-ups fitted to other samples, of set `fit`.
    pub from_fit_rows: Vec<usize>,
}

impl Application {
    /// Predicts the samples with the fitted parameters.
    pub(super) fn prediction(&self) -> Prediction {
        self.prediction_at(&self.values)
    }

    /// Predicts the samples with these parameter values (deviations, SI).
    pub(super) fn prediction_at(&self, values: &[f64]) -> Prediction {
        let Application { problem, refitted, from_fit_rows, .. } = self;
        let names = |parameters: &[usize]| parameters.iter().map(|&p| problem.parameters()[p].name.clone()).collect();
        Prediction {
            sample_ids: problem.sample_ids().to_vec(),
            residuals: problem.residuals(values),
            orientations: problem.orientation_residuals(values),
            refitted: names(refitted),
            from_fit_rows: names(from_fit_rows),
        }
    }
}
