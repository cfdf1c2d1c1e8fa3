//! The scatter of tracker, CMM and plungers is as specified: no more, no less, and independent on each axis.

use std::collections::BTreeSet;
use std::num::NonZeroU32;

use calibench::units::UM;
use calibench_sim::cmm::SimulatedCmm;
use calibench_sim::contact::DATUM_RADIUS;
use calibench_sim::gauge::Gauge;
use calibench_sim::plunger::{PlungerSpec, PresentedBall};
use calibench_sim::random::Streams;
use calibench_sim::tracker::{SimulatedTracker, TrackerSpec};
use nalgebra::{Matrix3, Point3, Vector3};

const CENTRED: PresentedBall = PresentedBall { centre: Vector3::new(0.0, 0.0, 0.0), radius: DATUM_RADIUS };
/// Number of measurements: their covariance has a relative standard error of 1 %.
const SHOTS: u32 = 20_000;
/// Gaussian noise, with a fresh seed, exceeds this many standard errors with probability 1e-6 per entry, 2e-5 over this
/// whole file.
const ALLOWED: f64 = 4.9;

/// Asserts that errors are Gaussian-like with one-sigma `sigma` about zero, independent from axis to axis.
fn assert_white(errors: &[Vector3<f64>], sigma: f64, what: &str) {
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<Vector3<f64>>() / n;
    assert!(mean.amax() < ALLOWED * sigma / n.sqrt(), "{what}: mean {mean}");
    let covariance = errors.iter().map(|e| e * e.transpose()).sum::<Matrix3<f64>>() / (n * sigma * sigma);
    for i in 0..3 {
        let off = (covariance[(i, i)] - 1.0) / (2.0 / n).sqrt();
        assert!(off.abs() < ALLOWED, "{what}, axis {i}: variance {off} standard errors off");
        let cross = covariance[(i, (i + 1) % 3)] * n.sqrt();
        assert!(cross.abs() < ALLOWED, "{what}, axis {i}: correlation of {cross} standard errors");
    }
}

#[test]
fn tracker_points_scatter_by_the_shot_over_the_root_of_the_shots() {
    let mut rng = Streams { seed: 21, trial: 0 }.stream("tracker");
    let nests = [Vector3::zeros(), Vector3::new(0.3, 0.0, 0.0), Vector3::new(0.0, 0.3, 0.0)];
    let point_shots = NonZeroU32::new(9).expect("nine is not zero");
    let spec = TrackerSpec { shot: 18.0 * UM, point_shots, ..TrackerSpec::default() };
    let tracker = SimulatedTracker::set_up(&spec, &nests, &mut rng).expect("the nests are spread");
    let point = Vector3::new(0.4, 0.2, 0.9);
    let believed = tracker.registration_error() * Point3::from(point);
    let errors: Vec<_> = (0..SHOTS).map(|_| tracker.measure(&point, &mut rng) - believed.coords).collect();
    assert_white(&errors, 6.0 * UM, "tracker");
}

#[test]
fn certified_balls_scatter_by_the_uncertainty() {
    let mut rng = Streams { seed: 22, trial: 0 }.stream("cmm");
    let ball = Vector3::new(-0.0795, -0.3301, 0.0175);
    let cmm = SimulatedCmm::default();
    let errors: Vec<_> = (0..SHOTS).map(|_| cmm.measure_ball(&ball, &mut rng) - ball).collect();
    assert_white(&errors, 1.9 * UM, "CMM");
}

#[test]
fn readings_scatter_by_the_noise_of_each_plunger() {
    let sigma = 0.08 * UM;
    let mut gauge = Gauge::draw(&PlungerSpec { noise: [sigma; 2], ..PlungerSpec::ideal() }, &Streams { seed: 23, trial: 0 });
    gauge.present(Some(CENTRED));
    let errors: Vec<_> =
        (0..SHOTS).map(|_| Vector3::from_fn(|k, _| gauge.read(k).expect("a centred ball is in range"))).collect();
    assert_white(&errors, sigma, "plungers");
}

#[test]
fn readings_stand_on_the_steps_of_the_display() {
    let step = 0.1 * UM;
    let spec = PlungerSpec { resolution: step, noise: [0.08 * UM; 2], ..PlungerSpec::ideal() };
    let mut gauge = Gauge::draw(&spec, &Streams { seed: 24, trial: 0 });
    gauge.present(Some(CENTRED));
    let mut seen = BTreeSet::new();
    for _ in 0..1000 {
        let steps = gauge.read(0).expect("a centred ball is in range") / step;
        assert!((steps - steps.round()).abs() < 1e-9);
        seen.insert(steps.round() as i64);
    }
    // 0.8 sigma per step: five steps hold all but one reading in ten thousand, and 1000 readings miss +-1 with
    // probability below 1e-100.
    assert!(seen.contains(&0) && seen.contains(&1) && seen.contains(&-1) && seen.len() < 12, "{seen:?}");
}

#[test]
fn answers_are_lost_as_often_as_specified_and_shift_no_noise() {
    let streams = Streams { seed: 25, trial: 0 };
    let (sure, rate) = (PlungerSpec { noise: [0.08 * UM; 2], ..PlungerSpec::ideal() }, 0.05);
    let mut steady = Gauge::draw(&sure, &streams);
    let mut flaky = Gauge::draw(&PlungerSpec { drop_out: rate, ..sure }, &streams);
    let mut lost = 0.0;
    for _ in 0..SHOTS {
        let expected = steady.read(2).expect("never lost");
        match flaky.read(2) {
            Ok(reading) => assert_eq!(reading, expected),
            Err(_) => lost += 1.0,
        }
    }
    let n = f64::from(SHOTS);
    assert!((lost - rate * n).abs() < ALLOWED * (n * rate * (1.0 - rate)).sqrt(), "{lost} of {n} lost");
}
