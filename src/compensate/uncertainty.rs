//! Uncertainty of compensated targets.

use nalgebra::{DMatrix, Matrix3xX, SymmetricEigen};

use super::calibrated_arm::CalibratedArm;
use crate::identify::calibration::Calibration;
use crate::residuals::unexplained;

/// Predicted standard uncertainty of the TCP's position, m: that of the identified parameters, combined with the residual
/// error of the model on its own data. Where the model was not tested against data, its error may be larger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertainty {
    /// Along the worst direction.
    pub worst_axis: f64,
    /// Length of the error, rms: the root of the sum of three variances.
    pub three_d: f64,
}

/// The covariance of a calibration, in a form that is quickly propagated to many postures.
pub(super) struct Spread {
    /// R with R R^T = covariance of the estimates, SI.
    root: DMatrix<f64>,
    /// Mean square, m², of the model's residuals beyond their noise, all three axes together.
    unexplained: f64,
    columns: Matrix3xX<f64>,
    carried: Matrix3xX<f64>,
}

impl Spread {
    pub fn of(calibration: &Calibration) -> Self {
        let m = calibration.estimates.len();
        let sigma = |k: usize| calibration.estimates[k].sigma;
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(calibration.correlation.clone());
        let mut root = eigenvectors;
        for (k, mut column) in root.column_iter_mut().enumerate() {
            // Rounding in a file may make a vanishing eigenvalue negative.
            column *= eigenvalues[k].max(0.0).sqrt();
        }
        for (k, mut row) in root.row_iter_mut().enumerate() {
            row *= sigma(k);
        }
        Spread {
            root,
            unexplained: beyond_noise(calibration).powi(2),
            columns: Matrix3xX::zeros(m),
            carried: Matrix3xX::zeros(m),
        }
    }

    /// The uncertainty at the posture in which the arm last came to rest.
    pub fn at(&mut self, arm: &CalibratedArm<'_>) -> Uncertainty {
        arm.columns(&mut self.columns);
        self.columns.mul_to(&self.root, &mut self.carried);
        let covariance = &self.carried * self.carried.transpose();
        let largest = covariance.symmetric_eigenvalues().max().max(0.0);
        Uncertainty {
            worst_axis: (largest + self.unexplained / 3.0).sqrt(),
            three_d: (covariance.trace() + self.unexplained).sqrt(),
        }
    }
}

/// The residual, m, that noise does not explain: noise as stated leaves the residual over the root of chi² per degree of
/// freedom; where none is stated all of it counts, for lack of other evidence.
fn beyond_noise(calibration: &Calibration) -> f64 {
    let noise = if calibration.noise_stated { calibration.rms / calibration.chi2_per_dof.sqrt() } else { 0.0 };
    unexplained(calibration.rms, noise)
}
