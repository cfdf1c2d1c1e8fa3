//! The value, the speed and the acceleration of numbers at a moment, by a parabola through the readings near it.

use nalgebra::{Matrix3, Vector3};

use crate::series::Series;

/// Fewest readings through which a parabola is laid.
const FEWEST: usize = 5;

/// Numbers at a moment.
#[derive(Debug, Clone)]
pub(super) struct Local {
    pub values: Vec<f64>,
    /// Each a second.
    pub speeds: Vec<f64>,
    /// Each a second squared.
    pub accelerations: Vec<f64>,
    /// One-sigma of a reading about the parabola.
    pub scatter: Vec<f64>,
    pub readings: usize,
}

/// The numbers at `at`, by the readings less than `half` from it; `None` if these are too few, or all on one side.
///
/// A parabola leaves what a motion does within some hundredths of a second as it is, and joints and instrument are read by the same
/// one: what it smooths it smooths in both.
pub(super) fn local(series: &Series, at: f64, half: f64) -> Option<Local> {
    let width = series.ranges.len();
    let [from, to] = [at - half, at + half].map(|t| series.times.partition_point(|&time| time < t));
    let row = |k: usize| &series.values[k * width..(k + 1) * width];
    let inside: Vec<usize> = (from..to).filter(|&k| row(k).iter().all(|v| v.is_finite())).collect();
    let (Some(&first), Some(&last)) = (inside.first(), inside.last()) else { return None };
    if inside.len() < FEWEST || series.times[first] > at - half / 2.0 || series.times[last] < at + half / 2.0 {
        return None;
    }
    let basis = |k: usize| {
        let u = (series.times[k] - at) / half;
        Vector3::new(1.0, u, u * u)
    };
    let normal: Matrix3<f64> = inside.iter().map(|&k| basis(k) * basis(k).transpose()).sum();
    let inverse = normal.try_inverse()?;
    let n = inside.len();
    let mut found =
        Local { values: Vec::new(), speeds: Vec::new(), accelerations: Vec::new(), scatter: Vec::new(), readings: n };
    for c in 0..width {
        let middle = row(inside[n / 2])[c];
        let pull: Vector3<f64> = inside.iter().map(|&k| basis(k) * (row(k)[c] - middle)).sum();
        let parabola = inverse * pull;
        let squares: f64 = inside.iter().map(|&k| (row(k)[c] - middle - parabola.dot(&basis(k))).powi(2)).sum();
        found.values.push(middle + parabola.x);
        found.speeds.push(parabola.y / half);
        found.accelerations.push(2.0 * parabola.z / (half * half));
        found.scatter.push((squares / (n - 3).max(1) as f64).sqrt());
    }
    Some(found)
}
