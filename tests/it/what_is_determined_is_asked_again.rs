//! What a fit leaves at nominal for its plausible size is asked again where the residuals say otherwise: an arm whose zeros were
//! lost is identified, whether its noise is stated or not, and a good arm shows no lost zero.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibench::identify::{Model, identify};
use calibench::measure::dataset::file::read_dataset;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::residuals::misfit::abnormal;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, built_in};
use calibench::units::{DEG, MM, UM};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn case(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/cases").join(name)
}

/// Joints in degrees and points in millimetres, as a table has them; the noise is not stated.
fn unmastered() -> Dataset {
    let text = std::fs::read_to_string(case("unmastered-ur5").join("samples.csv")).unwrap();
    let numbers = |line: &str| line.split(',').map(|x| x.parse::<f64>().unwrap()).collect::<Vec<f64>>();
    let sample = |(k, line): (usize, &str)| {
        let row = numbers(line);
        let q = row[..6].iter().map(|x| x * DEG).collect();
        Sample::new(format!("s{k}"), q, Measured::Point(Vector3::from_row_slice(&row[6..]) * MM))
    };
    let samples = text.lines().skip(1).enumerate().map(sample).collect();
    Dataset { robot: Arc::new(built_in("ur5").unwrap()), tool_free: true, samples, ..Dataset::default() }
}

#[test]
fn zeros_lost_by_degrees_are_found_without_a_stated_noise() {
    let data = unmastered();
    let calibration = identify(&[NamedDataset::new("campaign", &data)], &Model::default_for(&data)).unwrap();
    assert!(calibration.rms < 0.1 * MM, "{} mm", calibration.rms / MM);
    for (name, degrees) in [("theta2", 1.5), ("theta3", -2.0), ("theta4", 1.2), ("theta5", -1.7)] {
        let found = calibration.estimate(name).unwrap();
        let off = (found.value - found.nominal) / DEG;
        assert!((off - degrees).abs() < 0.05, "{name}: {off}");
    }
    let named: Vec<usize> = abnormal(&calibration).iter().filter_map(|a| a.zero_of).collect();
    assert_eq!(named, [3, 5, 2, 4], "largest first");
}

#[test]
fn zeros_lost_by_degrees_are_found_where_a_large_noise_is_stated() {
    let data = read_dataset(&case("lost-zeros-camera")).unwrap();
    let calibration = identify(&[NamedDataset::new("campaign", &data)], &Model::default_for(&data)).unwrap();
    // 1 mm per axis is stated and true, and a least-squares fit of all 21 that are independent leaves 1.60 mm.
    assert!(calibration.rms < 1.65 * MM, "{} mm", calibration.rms / MM);
    assert!((0.7..1.4).contains(&calibration.chi2_per_dof), "{}", calibration.chi2_per_dof);
}

/// A good arm measured 30 times with this noise, and whether that is stated.
fn good(random: &mut ChaCha8Rng, sigma: f64, stated: bool) -> Dataset {
    let robot = Arc::new(built_in("ur5").unwrap());
    let normal = |size: f64, random: &mut ChaCha8Rng| size * (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
    let off: Vec<f64> = (0..6).map(|_| normal(0.05 * DEG, random)).collect();
    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.03, 0.02, 0.1], ..FramePose::default() });
    let samples = (0..30).map(|k| {
        let q: Vec<f64> = (0..6).map(|_| random.random_range(-2.0..2.0)).collect();
        let truly: Vec<f64> = q.iter().zip(&off).map(|(q, off)| q + off).collect();
        let seen = world_from_tool(&robot, &base, &tool, &truly).translation.vector;
        let noise = Vector3::from_fn(|_, _| normal(sigma, random));
        Sample::new(format!("p{k}"), q, Measured::Point(seen + noise))
    });
    let samples = samples.collect();
    let noise = Noise { point: stated.then_some(sigma), ..Noise::default() };
    Dataset { robot, base, tool, tool_free: true, noise, samples, ..Dataset::default() }
}

#[test]
fn a_good_arm_shows_no_lost_zero() {
    let mut random = ChaCha8Rng::seed_from_u64(3601);
    for k in 0..40 {
        let sigma = if k % 2 == 0 { 1.0 * MM } else { 50.0 * UM };
        let data = good(&mut random, sigma, k % 4 < 2);
        let calibration = identify(&[NamedDataset::new("campaign", &data)], &Model::geometry()).unwrap();
        assert_eq!(abnormal(&calibration), [], "{k}");
    }
}
