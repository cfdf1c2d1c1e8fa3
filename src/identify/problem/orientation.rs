//! The orientation of a sample, as three scalar residuals beside those of its position.
//!
//! `residual = log(R_measured R_predicted^T)`, a rotation vector in the world, with
//! `R_predicted = R_flange R_tool exp(w)`, where `w` is the rotation vector of the probe's axes relative to the tool's.

use nalgebra::{Matrix3, Matrix6, Rotation3, SMatrix, Vector3, Vector6};

use crate::math::linalg::LinalgError;
use crate::math::positive_definite::whitener;
use crate::measure::dataset::{Orientation, Sample};
use crate::robot::sites::Site;
use crate::robot::{Frame, rotation_vector};

/// Below this angle, rad, series replace quotients that vanish.
const SMALL: f64 = 1e-4;

/// The measured orientation of one sample.
#[derive(Debug, Clone)]
pub(super) struct OrientationPart {
    measured: Rotation3<f64>,
    /// One-sigma about each axis, rad.
    sigma: f64,
    /// Nominal rotation from the tool's axes to those of the last frame.
    tool: Rotation3<f64>,
    /// The world's origin as the tool saw it, axes of the probe, m, if it was the tool that saw the world. The position of the
    /// sample is then that of this point of the tool, which is at the world's origin.
    origin: Option<Vector3<f64>>,
    /// The last three rows of W (6 x 6), for the whole pose with `W^T W = Sigma^-1`; W is lower triangular.
    whitener: SMatrix<f64, 3, 6>,
}

/// A measured orientation beside the predicted one.
pub(super) struct SeenOrientation {
    /// Measured minus predicted, world axes, rad.
    pub residual: Vector3<f64>,
    /// Maps a rotation of the probe in the world to the change of the residual that it subtracts.
    onto: Matrix3<f64>,
    /// World axes about which the components of the probe's rotation vector turn it.
    turns: Matrix3<f64>,
    /// From the TCP to the origin as seen, world axes, m, and how far it is from where the start of the fit has it.
    arm: Vector3<f64>,
    moved: Vector3<f64>,
}

impl SeenOrientation {
    /// Displacement, world, m, of the measured point by turning the probe as identified from where the fit began.
    pub fn moved(&self) -> Vector3<f64> {
        self.moved
    }

    /// Displacement of the measured point, world, m, by one SI unit of a site that turns the flange about `axis`, beyond that of
    /// the point where the fit began.
    #[inline]
    pub fn shift(&self, site: Site, axis: &Vector3<f64>) -> Vector3<f64> {
        match site {
            Site::Probe(k) => self.turns.column(k.into()).cross(&self.arm),
            _ => axis.cross(&self.moved),
        }
    }

    /// Derivative of the residual, with opposite sign, by one SI unit of a site that turns the flange about `axis`.
    #[inline]
    pub fn column(&self, site: Site, axis: &Vector3<f64>) -> Vector3<f64> {
        match site {
            Site::Probe(k) => self.onto * self.turns.column(k.into()),
            _ => self.onto * axis,
        }
    }
}

impl OrientationPart {
    /// The orientation of a sample, if it was measured, for a tool with these axes in the last frame; `sigma` as stated. `at` is
    /// where the tool was measured, if it was the tool that saw the world.
    pub fn of(orientation: Orientation, sigma: f64, tool: Rotation3<f64>, at: Option<&Vector3<f64>>) -> Self {
        let measured = orientation.world_from_tool();
        let origin = at.map(|at| -(measured.inverse() * at));
        OrientationPart { measured, sigma, tool, origin, whitener: SMatrix::zeros() }
    }

    /// True if it was the tool that saw the world.
    #[inline]
    pub fn sees_origin(&self) -> bool {
        self.origin.is_some()
    }

    /// From the TCP to the world's origin as the tool saw it, axes of the last frame, m; `w` is the probe's rotation vector.
    /// `None` if the tool was seen.
    #[inline]
    pub fn to_origin(&self, w: &Vector3<f64>) -> Option<Vector3<f64>> {
        self.origin.map(|origin| self.tool * (Rotation3::new(*w) * origin))
    }

    /// Compares it with the arm as posed; the probe's rotation vector is `start`, and `turned` more.
    pub fn seen(&self, flange: &Frame, start: &Vector3<f64>, turned: &Vector3<f64>) -> SeenOrientation {
        let flange = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[flange.x, flange.y, flange.z]));
        let w = start + turned;
        let predicted = flange * self.tool * Rotation3::new(w);
        let residual = rotation_vector(&(self.measured * predicted.inverse()));
        let arm = self.origin.map_or(Vector3::zeros(), |origin| predicted * origin);
        let moved = self.to_origin(start).map_or(Vector3::zeros(), |from| arm - flange * from);
        let turns = predicted.matrix() * right_jacobian(&w);
        SeenOrientation { residual, onto: inverse_right_jacobian(&residual), turns, arm, moved }
    }

    /// States the noise of the whole pose: that of the instrument, and that of the joints, whose columns are `joints`.
    ///
    /// # Errors
    /// When it is not finite.
    pub fn state_noise(&mut self, sigma_position: f64, joints: impl Iterator<Item = Vector6<f64>>) -> Result<(), LinalgError> {
        let (p, o) = (sigma_position * sigma_position, self.sigma * self.sigma);
        let instrument = Matrix6::from_diagonal(&Vector6::new(p, p, p, o, o, o));
        let covariance = joints.fold(instrument, |sum, column| sum + column * column.transpose());
        self.whitener = whitener(covariance)?.fixed_rows::<3>(3).into_owned();
        Ok(())
    }

    /// Whitens the orientation's part of a displacement of the tool: shift, m, and turn, rad.
    #[inline]
    pub fn whitened(&self, shift: &Vector3<f64>, turn: &Vector3<f64>) -> Vector3<f64> {
        self.whitener.fixed_columns::<3>(0) * shift + self.whitener.fixed_columns::<3>(3) * turn
    }

    /// Length, m, that weights an angle as much as a displacement.
    pub fn lever(&self, sigma_position: f64) -> f64 {
        sigma_position / self.sigma
    }
}

/// One-sigma about each axis of a sample's orientation, rad; `None` if it has no orientation, or none that is stated.
pub(super) fn stated(sample: &Sample, of_dataset: Option<f64>) -> Option<(Orientation, f64)> {
    sample.orientation.and_then(|o| Some((o, o.sigma.or(of_dataset)?)))
}

/// `exp(w + dw) = exp(w) exp(J dw)` (Chirikjian 2011, section 10.6).
fn right_jacobian(w: &Vector3<f64>) -> Matrix3<f64> {
    let (angle, k) = (w.norm(), w.cross_matrix());
    let (first, second) = if angle < SMALL {
        (0.5, 1.0 / 6.0)
    } else {
        ((1.0 - angle.cos()) / (angle * angle), (angle - angle.sin()) / (angle * angle * angle))
    };
    Matrix3::identity() - k * first + k * k * second
}

/// `log(exp(r) exp(d)) = r + J d`.
fn inverse_right_jacobian(r: &Vector3<f64>) -> Matrix3<f64> {
    let (angle, k) = (r.norm(), r.cross_matrix());
    let second = if angle < SMALL {
        1.0 / 12.0
    } else {
        let half = 0.5 * angle;
        (1.0 - half * half.cos() / half.sin()) / (angle * angle)
    };
    Matrix3::identity() + k * 0.5 + k * k * second
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobians_are_the_derivatives_of_the_exponential() {
        for w in [Vector3::new(1e-6, -2e-6, 0.0), Vector3::new(0.3, -0.8, 1.1), Vector3::new(-1.7, 0.4, 2.0)] {
            for k in 0..3 {
                let step = Vector3::ith(k, 1e-6);
                let (before, after) = (Rotation3::new(w - step), Rotation3::new(w + step));
                let turned = rotation_vector(&(before.inverse() * after)) / 2e-6;
                assert!((right_jacobian(&w).column(k) - turned).norm() < 1e-8, "{w:?}");
                let added = |d: Vector3<f64>| rotation_vector(&(Rotation3::new(w) * Rotation3::new(d)));
                let moved = (added(step) - added(-step)) / 2e-6;
                assert!((inverse_right_jacobian(&w).column(k) - moved).norm() < 1e-7, "{w:?}");
            }
        }
    }
}
