//! The simulated laser tracker: noisy points in a world frame defined by three nests, which are measured with noise as well.

use std::num::NonZeroU32;

use calibench::robot::Pose;
use calibench::units::{DEG, UM};
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, Unit, Vector3};
use rand::Rng;
use thiserror::Error;

use crate::random::noisy_point;

/// Half-angle of the acceptance cone of a 1.5-inch SMR, rad (30 degrees, usual for open corner cubes; assumed).
pub const SMR_ACCEPTANCE: f64 = 30.0 * DEG;
/// Nests count as collinear if the third is off the line of the others by less than this share of the longest distance.
const NARROWEST_SPREAD: f64 = 1e-6;

/// Accuracy of a laser tracker.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerSpec {
    /// One-sigma of one shot, per axis, m.
    pub shot: f64,
    /// Shots averaged per point.
    pub point_shots: NonZeroU32,
    /// Shots averaged per nest.
    pub nest_shots: NonZeroU32,
}

impl Default for TrackerSpec {
    /// 18 um per axis and one shot per point: a FARO tracker a few metres away (16 um + 0.8 um/m in range, 20 um + 5
    /// um/m across; assumed).
    fn default() -> Self {
        TrackerSpec { shot: 18.0 * UM, point_shots: NonZeroU32::MIN, nest_shots: NonZeroU32::MIN }
    }
}

/// Reasons why a tracker cannot be set up.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum TrackerError {
    /// The nests do not determine the rotation about their line.
    #[error("the three nests lie on one line: the longest side is {along} m, the height over it {across} m")]
    NestsInLine {
        /// Longest distance between two nests, m.
        along: f64,
        /// Distance of the third from their line, m.
        across: f64,
    },
}

/// A tracker in one set-up: all its points share one small rigid error, that of its registration to the nests.
#[derive(Debug, Clone)]
pub struct SimulatedTracker {
    spec: TrackerSpec,
    measured_world_from_world: Pose,
}

impl SimulatedTracker {
    /// Measures the three `nests` (world frame, m), which define the world, and fits the frame to them by least squares
    /// (Kabsch 1976).
    ///
    /// The noise is the same along all axes, so the position of the tracker does not matter.
    ///
    /// # Errors
    /// When the nests lie on one line.
    pub fn set_up(spec: &TrackerSpec, nests: &[Vector3<f64>; 3], rng: &mut impl Rng) -> Result<Self, TrackerError> {
        let [along, across] = extent(nests);
        // Written so that NaN is refused too.
        let spread = across > NARROWEST_SPREAD * along;
        if !spread {
            return Err(TrackerError::NestsInLine { along, across });
        }
        let sigma = averaged(spec.shot, spec.nest_shots);
        let measured = nests.map(|nest| noisy_point(&nest, sigma, rng));
        Ok(SimulatedTracker { spec: spec.clone(), measured_world_from_world: best_fit(&measured, nests) })
    }

    /// The measured position (world frame as registered, m) of an SMR whose true centre is `point`.
    pub fn measure(&self, point: &Vector3<f64>, rng: &mut impl Rng) -> Vector3<f64> {
        let seen = noisy_point(point, averaged(self.spec.shot, self.spec.point_shots), rng);
        (self.measured_world_from_world * Point3::from(seen)).coords
    }

    /// The registration error: maps true points of the world to their positions in this set-up.
    pub fn registration_error(&self) -> &Pose {
        &self.measured_world_from_world
    }
}

/// True if an SMR at `smr` (m), whose open side faces along `normal`, returns the beam of a tracker at `tracker` (m); `limit`
/// (rad) is the half-angle of its acceptance.
pub fn faces(tracker: &Vector3<f64>, smr: &Vector3<f64>, normal: &Unit<Vector3<f64>>, limit: f64) -> bool {
    normal.angle(&(tracker - smr)) <= limit
}

fn averaged(shot: f64, shots: NonZeroU32) -> f64 {
    shot / f64::from(shots.get()).sqrt()
}

fn centroid(points: &[Vector3<f64>; 3]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / 3.0
}

/// Longest side of a triangle and its height over that side, m.
fn extent([a, b, c]: &[Vector3<f64>; 3]) -> [f64; 2] {
    let along = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    [along, (b - a).cross(&(c - a)).norm() / along]
}

/// The rigid motion that maps `from` to `to` with the least sum of squares (W. Kabsch, Acta Cryst. A32 (1976) 922).
fn best_fit(from: &[Vector3<f64>; 3], to: &[Vector3<f64>; 3]) -> Pose {
    let (from_centre, to_centre) = (centroid(from), centroid(to));
    let correlation: Matrix3<f64> = from.iter().zip(to).map(|(f, t)| (t - to_centre) * (f - from_centre).transpose()).sum();
    let svd = correlation.svd(true, true);
    let (u, v_t) = svd.u.zip(svd.v_t).expect("both factors were asked for");
    // Three points lie in a plane: the third direction is free, and is chosen to avoid a reflection.
    let handed = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    let rotation = Rotation3::from_matrix_unchecked(u * handed * v_t);
    Pose::from_parts(Translation3::from(to_centre - rotation * from_centre), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Streams;

    const NESTS: [Vector3<f64>; 3] = [Vector3::new(0.0, 0.0, 0.0), Vector3::new(0.25, 0.0, 0.0), Vector3::new(0.03, 0.4, 0.02)];

    #[test]
    fn the_fit_recovers_a_rigid_motion() {
        let motion = Pose::new(Vector3::new(0.3, -2.0, 0.7), Vector3::new(0.4, -1.1, 2.0));
        let moved = NESTS.map(|p| (motion * Point3::from(p)).coords);
        let fitted = best_fit(&NESTS, &moved);
        // Coordinates of metres, rounded to 4e-16, over nests 0.2 m apart.
        assert!((fitted.to_homogeneous() - motion.to_homogeneous()).norm() < 1e-13);
        assert!((fitted.rotation.matrix().determinant() - 1.0).abs() < 1e-13);
    }

    #[test]
    fn nests_on_a_line_are_refused() {
        let mut rng = Streams { seed: 1, trial: 0 }.stream("tracker");
        let line = [0.0, 0.1, 0.4].map(|x| Vector3::new(x, 2.0 * x, -x));
        let refused = SimulatedTracker::set_up(&TrackerSpec::default(), &line, &mut rng);
        assert!(matches!(refused, Err(TrackerError::NestsInLine { .. })));
        let nowhere = [Vector3::zeros(), Vector3::x(), Vector3::new(0.0, f64::NAN, 0.0)];
        assert!(SimulatedTracker::set_up(&TrackerSpec::default(), &nowhere, &mut rng).is_err());
    }

    #[test]
    fn a_noiseless_tracker_tells_the_truth() {
        let mut rng = Streams { seed: 1, trial: 0 }.stream("tracker");
        let spec = TrackerSpec { shot: 0.0, ..TrackerSpec::default() };
        let tracker = SimulatedTracker::set_up(&spec, &NESTS, &mut rng).expect("the nests are spread");
        let point = Vector3::new(0.7, -0.2, 1.1);
        // A metre away, rotated by rounding errors of 1e-16 over 0.2 m.
        assert!((tracker.measure(&point, &mut rng) - point).norm() < 1e-14);
    }

    #[test]
    fn an_smr_answers_only_from_its_open_side() {
        let (smr, up) = (Vector3::new(0.5, 0.0, 0.2), Vector3::z_axis());
        let tracker = |angle: f64| smr + 3.0 * Vector3::new(angle.sin(), 0.0, angle.cos());
        assert!(faces(&tracker(29.9 * DEG), &smr, &up, SMR_ACCEPTANCE));
        assert!(!faces(&tracker(30.1 * DEG), &smr, &up, SMR_ACCEPTANCE));
        assert!(!faces(&tracker(180.0 * DEG), &smr, &up, SMR_ACCEPTANCE));
    }
}
