//! Numbers of a robot file, and what is wrong with one.

use nalgebra::Vector3;

use crate::units::MM;

/// Key, problem and remedy.
pub(super) type Fault = (String, &'static str, &'static str);

pub(super) fn mm(v: &Vector3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z].map(|c| written(c / MM))
}

pub(super) fn metres(mm: &[f64; 3]) -> Vector3<f64> {
    Vector3::from(*mm).map(|c| c * MM)
}

/// Numbers in files are rounded to 1e-9 mm and deg: below any significance, above conversion noise.
pub(super) fn written(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}
