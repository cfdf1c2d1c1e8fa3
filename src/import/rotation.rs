//! Orientations of a source table: the ways in which three, four or nine numbers state a rotation.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::math::nearest_rotation;
use crate::robot::rotation_vector;

/// The way in which numbers state a rotation from the tool's to the world's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RotationForm {
    /// Components of a rotation vector in the world.
    Vector,
    /// KUKA's A, B, C: about Z, then the new Y, then the new X.
    Abc,
    /// Roll, pitch, yaw as in ROS: about the fixed axes X, Y, Z.
    Rpy,
    /// About X, then the new Y, then the new Z.
    Xyz,
    /// Kawasaki's O, A, T: about Z, then the new Y, then the new Z.
    Zyz,
    /// A quaternion, its real part last.
    QuaternionXyzw,
    /// A quaternion, its real part first.
    QuaternionWxyz,
    /// A rotation matrix, row by row.
    Matrix,
}

impl RotationForm {
    /// All forms, with their names in maps.
    pub const ALL: [(RotationForm, &'static str); 8] = [
        (RotationForm::Vector, "vector"),
        (RotationForm::Abc, "abc"),
        (RotationForm::Rpy, "rpy"),
        (RotationForm::Xyz, "xyz"),
        (RotationForm::Zyz, "zyz"),
        (RotationForm::QuaternionXyzw, "quaternion_xyzw"),
        (RotationForm::QuaternionWxyz, "quaternion_wxyz"),
        (RotationForm::Matrix, "matrix"),
    ];

    /// Its name in maps.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(form, _)| *form == self).map_or("", |(_, name)| name)
    }

    /// True if its numbers are angles.
    pub fn has_angles(self) -> bool {
        !matches!(self, RotationForm::QuaternionXyzw | RotationForm::QuaternionWxyz | RotationForm::Matrix)
    }

    /// Number of its numbers.
    pub fn count(self) -> usize {
        match self {
            RotationForm::QuaternionXyzw | RotationForm::QuaternionWxyz => 4,
            RotationForm::Matrix => 9,
            _ => 3,
        }
    }

    /// The rotation vector, rad, of these numbers (angles in rad); `None` if a quaternion is far from unit length,
    /// or a matrix from a rotation.
    pub fn rotation_vector(self, n: &[f64]) -> Option<Vector3<f64>> {
        let about = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
        let rotation = match self {
            RotationForm::Vector => return Some(Vector3::new(n[0], n[1], n[2])),
            RotationForm::Abc => Rotation3::from_euler_angles(n[2], n[1], n[0]),
            RotationForm::Rpy => Rotation3::from_euler_angles(n[0], n[1], n[2]),
            RotationForm::Xyz => {
                about(Vector3::x_axis(), n[0]) * about(Vector3::y_axis(), n[1]) * about(Vector3::z_axis(), n[2])
            }
            RotationForm::Zyz => {
                about(Vector3::z_axis(), n[0]) * about(Vector3::y_axis(), n[1]) * about(Vector3::z_axis(), n[2])
            }
            RotationForm::Matrix => {
                let stated = Matrix3::from_row_slice(n);
                nearest_rotation(&stated).filter(|r| (r.matrix() - stated).norm() < UNIT_LENGTH * 3f64.sqrt())?
            }
            RotationForm::QuaternionXyzw => return vector_of(Quaternion::new(n[3], n[0], n[1], n[2])),
            RotationForm::QuaternionWxyz => return vector_of(Quaternion::new(n[0], n[1], n[2], n[3])),
        };
        Some(rotation_vector(&rotation))
    }
}

/// Quaternions and axes of a matrix are written with few digits; one whose length is off by more than this is not one.
const UNIT_LENGTH: f64 = 0.01;

fn vector_of(quaternion: Quaternion<f64>) -> Option<Vector3<f64>> {
    let is_unit = (quaternion.norm() - 1.0).abs() < UNIT_LENGTH;
    is_unit.then(|| UnitQuaternion::from_quaternion(quaternion).scaled_axis())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_states_the_same_rotation() {
        // Rz(90 deg) Rx(90 deg): the tool's x axis is the world's y, its y the world's z, its z the world's x.
        let quarter = std::f64::consts::FRAC_PI_2;
        let third = 2.0 * std::f64::consts::FRAC_PI_3 / 3f64.sqrt();
        for (form, numbers) in [
            (RotationForm::Vector, vec![third; 3]),
            (RotationForm::Abc, vec![quarter, 0.0, quarter]),
            (RotationForm::Rpy, vec![quarter, 0.0, quarter]),
            (RotationForm::Xyz, vec![quarter, quarter, 0.0]),
            (RotationForm::Zyz, vec![0.0, quarter, quarter]),
            (RotationForm::QuaternionXyzw, vec![0.5, 0.5, 0.5, 0.5]),
            (RotationForm::QuaternionWxyz, vec![-0.5, -0.5, -0.5, -0.5]),
            (RotationForm::Matrix, vec![0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
        ] {
            let turned = Rotation3::new(form.rotation_vector(&numbers).expect("a rotation"));
            assert_eq!(numbers.len(), form.count());
            assert!((turned * Vector3::x() - Vector3::y()).norm() < 1e-12, "{form:?}");
            assert!((turned * Vector3::y() - Vector3::z()).norm() < 1e-12, "{form:?}");
        }
        assert_eq!(RotationForm::QuaternionXyzw.rotation_vector(&[0.5, 0.5, 0.5, 0.0]), None);
        let mirrored = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0];
        assert_eq!(RotationForm::Matrix.rotation_vector(&mirrored), None);
    }
}
