//! The registration error of a tracker on three noisy nests agrees with first-order theory everywhere in the cell.

use std::num::NonZeroU32;

use calibench::units::UM;
use calibench_sim::random::Streams;
use calibench_sim::tracker::{SimulatedTracker, TrackerSpec};
use nalgebra::{Matrix3, Point3, Vector3};

/// Number of registrations: their covariance has a relative standard error of 1 %.
const SET_UPS: u32 = 20_000;
/// A correct tracker, with a fresh seed, exceeds this many standard errors with probability 1e-6 per entry: 2e-5 for the 18
/// entries. Second-order terms of the rotation are noise / nest distance = 1e-4 of the first, a hundredth of a standard
/// error.
const ALLOWED: f64 = 4.9;

/// `s^2 (1/3 + [d] M^-1 [d]^T)`, d being the vector from the nests' centroid and M the inertia of three unit masses in
/// the nests.
fn analytic(nests: &[Vector3<f64>; 3], at: &Vector3<f64>, nest_sigma: f64) -> Matrix3<f64> {
    let centroid: Vector3<f64> = nests.iter().sum::<Vector3<f64>>() / 3.0;
    let inertia: Matrix3<f64> = nests
        .iter()
        .map(|nest| {
            let r = nest - centroid;
            Matrix3::identity() * r.norm_squared() - r * r.transpose()
        })
        .sum();
    let arm = (at - centroid).cross_matrix();
    let inverse = inertia.try_inverse().expect("the nests are spread");
    (Matrix3::identity() / 3.0 + arm * inverse * arm.transpose()) * nest_sigma.powi(2)
}

#[test]
fn tracker_registration_error_has_its_analytic_covariance() {
    let nests = [Vector3::new(0.0, 0.0, 0.0), Vector3::new(0.25, 0.0, 0.0), Vector3::new(0.03, 0.4, 0.02)];
    let nest_shots = NonZeroU32::new(4).expect("four is not zero");
    let spec = TrackerSpec { shot: 18.0 * UM, nest_shots, ..TrackerSpec::default() };
    let places = [Vector3::new(0.0, 0.0, 0.0), Vector3::new(-0.5, 0.1, 0.8), Vector3::new(0.3, -0.7, 0.1)];
    let mut sums = [Matrix3::zeros(); 3];
    for trial in 0..SET_UPS {
        let mut rng = Streams { seed: 11, trial: trial.into() }.stream("tracker");
        let tracker = SimulatedTracker::set_up(&spec, &nests, &mut rng).expect("the nests are spread");
        for (sum, place) in sums.iter_mut().zip(&places) {
            let error = (tracker.registration_error() * Point3::from(*place)).coords - place;
            *sum += error * error.transpose();
        }
    }
    for (sum, place) in sums.iter().zip(&places) {
        let (seen, expected) = (sum / f64::from(SET_UPS), analytic(&nests, place, spec.shot / 2.0));
        for i in 0..3 {
            for j in 0..=i {
                let spread = expected[(i, i)] * expected[(j, j)] + expected[(i, j)].powi(2);
                let standard_error = (spread / f64::from(SET_UPS)).sqrt();
                let off = (seen[(i, j)] - expected[(i, j)]) / standard_error;
                assert!(off.abs() < ALLOWED, "at {place:?}, entry {i} {j}: {off} standard errors, {seen} {expected}");
            }
        }
    }
}
