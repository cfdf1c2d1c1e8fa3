//! The rigid motion that best maps one set of points onto another (Kabsch 1976; proper rotations only).

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

/// The pose that minimises `sum |pose * from - to|²` over (from, to) pairs, m; `None` for fewer than three pairs or points
/// on a line.
pub fn rigid_fit(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<IsometryMatrix3<f64>> {
    if pairs.len() < 3 {
        return None;
    }
    let n = pairs.len() as f64;
    let from = pairs.iter().map(|(f, _)| f).sum::<Vector3<f64>>() / n;
    let to = pairs.iter().map(|(_, t)| t).sum::<Vector3<f64>>() / n;
    let covariance: Matrix3<f64> = pairs.iter().map(|(f, t)| (t - to) * (f - from).transpose()).sum();
    let rotation = nearest_rotation(&covariance)?;
    Some(IsometryMatrix3::from_parts(Translation3::from(to - rotation * from), rotation))
}

/// The proper rotation that maximises the trace of its product with the transposed matrix; `None` if the matrix does not
/// determine it.
pub(crate) fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<Rotation3<f64>> {
    let svd = matrix.svd(true, true);
    if svd.singular_values[1] <= 1e-9 * svd.singular_values[0] {
        return None;
    }
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut proper = Matrix3::identity();
    proper[(2, 2)] = (u * v_t).determinant().signum();
    Some(Rotation3::from_matrix_unchecked(u * proper * v_t))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recovers_the_motion_that_made_the_points() {
        let pose = IsometryMatrix3::from_parts(Translation3::new(0.3, -0.2, 0.9), Rotation3::from_euler_angles(2.8, -0.4, 1.9));
        let points = [[0.0, 0.0, 0.0], [0.4, 0.1, 0.0], [0.1, 0.5, 0.2], [-0.3, 0.2, 0.6]].map(Vector3::from);
        let pairs: Vec<_> = points.iter().map(|p| (*p, pose.rotation * p + pose.translation.vector)).collect();
        let found = rigid_fit(&pairs).expect("four points in general position");
        assert!((found.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-14);
    }

    #[test]
    fn refuses_points_on_a_line() {
        let pairs: Vec<_> = (0..5).map(|k| (Vector3::x() * f64::from(k), Vector3::y() * f64::from(k))).collect();
        assert!(rigid_fit(&pairs).is_none());
    }
}
