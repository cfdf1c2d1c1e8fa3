//! The size of many residuals in one figure.

use nalgebra::Vector3;

/// Root mean square of the lengths of vectors, in their unit; zero of none.
///
/// ```
/// use calibench::nalgebra::Vector3;
///
/// let errors = [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 7.0, 0.0)];
/// assert_eq!(calibench::math::rms(&errors), 5.0);
/// ```
pub fn rms(vectors: &[Vector3<f64>]) -> f64 {
    (vectors.iter().map(Vector3::norm_squared).sum::<f64>() / vectors.len().max(1) as f64).sqrt()
}
