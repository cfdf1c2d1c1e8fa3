//! The currents that hold the arm become the joints' moments in every sample, where they are asked for.
#![cfg(unix)]

use std::process::Output;

use calibench::measure::dataset::Dataset;
use calibench::measure::dataset::file::read_dataset;
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::SiteIndex;
use calibench::robot::statics::{DEFAULT_GRAVITY, Loads};
use nalgebra::Vector3;

use crate::served::{Bench, Make};

/// Torque per ampere of the served drives by their data sheet.
const PER_AMPERE: &str = "torques.nm_per_a = [12.0, 12.0, 12.0, 9.0, 9.0, 9.0]";

/// The drives of the twin deviate from it by 2 % at most, and friction holds 1 N·m of the load.
const DRIVES: f64 = 0.02;
const FRICTION_NM: f64 = 1.0;

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&[&output.stdout[..], &output.stderr].concat()).into_owned()
}

/// Moments of the nominal arm with the payload of this sample, N·m.
fn by_masses(dataset: &Dataset, sample: usize) -> Vec<f64> {
    let (robot, sample) = (&dataset.robot, &dataset.samples[sample]);
    let mut posture = Posture::new(robot);
    let none = calibench::robot::FramePose::default();
    posture.set(robot, &none, &none, &sample.q, &vec![0.0; SiteIndex::new(sample.q.len()).len()]);
    let mut loads = Loads::new(sample.q.len());
    loads.compute(robot, &posture, &dataset.payloads[sample.payload], &DEFAULT_GRAVITY, &Vector3::zeros());
    loads.tau
}

#[test]
fn moments_of_probings_are_those_of_the_masses() {
    let bench = Bench::small_of(Make::Ur);
    let served = bench.serve(&[]);
    bench.write_cell(&served, PER_AMPERE, "", "[guards]\njoint_margin_deg = 0.0");
    let output = bench.measured("told", &[]);
    assert!(output.status.success(), "{}", said(&output));
    let dataset = read_dataset(&bench.path("told")).unwrap();
    assert!(!dataset.samples.is_empty());
    let mut largest = 0.0f64;
    for (k, sample) in dataset.samples.iter().enumerate() {
        let measured = sample.tau.as_ref().unwrap();
        for (joint, (is, expected)) in measured.iter().zip(by_masses(&dataset, k)).enumerate() {
            // A part of the difference: the force of the plungers and the true payload.
            let allowed = FRICTION_NM + (DRIVES + 0.02) * expected.abs() + 0.2;
            assert!((is - expected).abs() < allowed, "{} joint {}: {is} {expected}", sample.id, joint + 1);
            largest = largest.max(is.abs());
        }
    }
    assert!(largest > 20.0, "the shoulder carries the arm: {largest} N·m");
}

#[test]
fn a_software_that_does_not_convert_currents_is_named() {
    let bench = Bench::small_of(Make::Ur);
    let served = bench.serve(&[]);
    let cell = bench.write_cell(&served, "torques = {}", "", "");
    let output = bench.measured("untold", &[]);
    let words = said(&output);
    assert!(!output.status.success() && words.contains("give robot.torques.nm_per_a"), "{words}");
    let text = std::fs::read_to_string(&cell).unwrap();
    std::fs::write(&cell, text.replace("torques = {}", "torques.nm_per_a = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1]")).unwrap();
    let output = bench.measured("untold", &[]);
    let words = said(&output);
    assert!(output.status.code() == Some(2) && words.contains("robot.torques.nm_per_a"), "{words}");
}
