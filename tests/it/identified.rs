//! A calibration as `identify` makes them, of sizes that real arms have: for tests of what is done with one.
#![allow(dead_code)] // each test uses its own part

use std::sync::Arc;

use calibench::compensate::conditions::Conditions;
use calibench::compensate::{Desired, Target};
use calibench::effects::{Subject, build};
use calibench::identify::calibration::{Calibration, Estimate, MeasuredSetup};
use calibench::identify::fit::Outcome;
use calibench::identify::{FittedRows, Model};
use calibench::math::Observability;
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM};
use nalgebra::{DMatrix, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The paper's model, and effects of every kind that follows posture, load, time or side.
pub const EFFECTS: [&str; 12] = [
    "base_frame",
    "mdh",
    "joint_compliance",
    "tool_frame",
    "harmonic1:2",
    "stiffening:3",
    "gravity_backlash:2",
    "bearing_tilt:1",
    "link_bending:2",
    "pedestal",
    "payload_mass",
    "hysteresis:4",
];

/// The set-up: the paper's, tilted.
pub fn setup() -> MeasuredSetup {
    let payload = |name: &str, mass: f64| Payload { name: name.into(), mass, com: Vector3::new(25.0, 0.0, -70.0) * MM };
    MeasuredSetup {
        label: String::new(),
        dataset: "cell".into(),
        session: String::new(),
        base: FramePose { xyz: [-0.5363, -0.0219, -0.0583], rz_ry_rx: [0.4, 0.01, -0.02] },
        tool: FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.3, -0.2, 2.9] },
        gravity: Vector3::new(0.0, 0.0, -9.81),
        payloads: vec![payload("trical", 6.0), payload("light", 1.3)],
        duration_s: Some(3600.0),
    }
}

/// A calibration of `robot` with these effects, each number drawn within one plausible size and known to a tenth of it.
pub fn calibration_of(robot: Robot, effects: &[&str], seed: u64) -> Calibration {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let setup = setup();
    let mut estimates = Vec::new();
    for id in effects {
        let effect = build(id, &Subject::new(&robot, &[])).unwrap();
        for (k, spec) in effect.parameters().iter().enumerate() {
            let nominal = match *id {
                "base_frame" => setup.base.to_array()[k],
                "tool_frame" => setup.tool.xyz[k],
                _ => spec.nominal,
            };
            // A gearbox gives way to its load: no plausible compliance is negative.
            let drawn: f64 = if *id == "joint_compliance" { random.random() } else { random.random_range(-1.0..1.0) };
            estimates.push(Estimate {
                name: spec.name.clone(),
                effect: (*id).into(),
                unit: spec.unit,
                value: nominal + drawn * spec.prior,
                sigma: 0.1 * spec.prior,
                sigma_noise: 0.1 * spec.prior,
                nominal,
                stated_sigma: None,
            });
        }
    }
    let m = estimates.len();
    Calibration {
        joint_ranges: robot.links.iter().map(|l| l.limits).collect(),
        robot_reference: robot.name.clone(),
        robot: Arc::new(robot),
        model: Model::of(effects),
        estimates,
        correlation: DMatrix::identity(m, m),
        unresolved: Vec::new(),
        setups: vec![setup],
        outcome: Some(Outcome::Converged),
        samples: 80,
        rms: 0.0,
        rms_orientation: None,
        chi2_per_dof: 1.0,
        dof: 200,
        rank: m,
        condition: 100.0,
        observability: Observability { o1: 1.0, o2: 1.0, o3: 1.0, o4: 1.0, o5: 1.0 },
        noise_stated: true,
        iterations: 5,
        dataset_hashes: Vec::new(),
        misfit: None,
        fitted_rows: FittedRows::default(),
        absolute_accuracy: None,
        fleet_robots: None,
    }
}

/// The KR 6 R700 with all of [`EFFECTS`].
pub fn calibration(seed: u64) -> Calibration {
    calibration_of(built_in("kr6_r700").unwrap(), &EFFECTS, seed)
}

/// Joints (rad) well inside the limits, away from the singularities of the KR 6.
pub fn postures(count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut postures = Vec::new();
    while postures.len() < count {
        let mut between = |low: f64, high: f64| random.random_range(low..high) * DEG;
        let five = between(15.0, 110.0) * if between(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
        let q = vec![
            between(-160.0, 160.0),
            between(-130.0, 30.0),
            between(30.0, 140.0),
            between(-175.0, 175.0),
            five,
            between(-340.0, 340.0),
        ];
        postures.push(q);
    }
    postures
}

/// A target that nothing more is said of.
pub fn target(id: impl Into<String>, desired: Desired) -> Target {
    Target { id: id.into(), desired, payload: None, conditions: Conditions::default() }
}
