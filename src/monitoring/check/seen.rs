//! A sample of a check, with what displaces it.

use std::ops::Range;

use nalgebra::Vector3;

/// A sample as it is measured again: its whitened displacements.
pub(super) struct Seen {
    /// Id of the sample.
    pub id: String,
    /// Name of the ball, for a ball.
    pub ball: Option<String>,
    /// Name of the measured point of the tool; `None` for the TCP.
    pub point: Option<String>,
    /// Its scalar differences, by index.
    pub rows: Range<usize>,
    /// Samples of equal number are of one pose of the arm, of one stay there, and of one target there.
    pub pose: usize,
    pub event: usize,
    pub target: usize,
    /// Number of measurements that it is compared with.
    pub counterparts: f64,
    /// Variance of the noise of one of them, in units of its own, as stated.
    pub earlier: f64,
    /// Whitened motions of all targets of a pose from one stay there to the next, one-sigma each.
    pub common: Vec<Vector3<f64>>,
    /// Whitened displacement per unit, by condition, of those that act on all samples.
    pub tool: Vec<Vector3<f64>>,
    pub base: Vec<Vector3<f64>>,
    pub joints: Vec<Vector3<f64>>,
    /// Torques of the load, N m, and sides of the approach, -1 or 1, by joint; no sides where they are not known.
    pub torques: Vec<f64>,
    pub sides: Vec<f64>,
    pub growth: Vector3<f64>,
    pub mass: Option<Vector3<f64>>,
    pub moved: Vec<Vector3<f64>>,
}

/// Number of scalar differences after each sample.
pub(super) fn ends(seen: &[&Seen]) -> Vec<usize> {
    seen.iter()
        .scan(0, |end, s| {
            *end += s.rows.len();
            Some(*end)
        })
        .collect()
}
