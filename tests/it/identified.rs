//! A calibration as `identify` makes them, of sizes that real arms have: for tests of what is done with one.
#![allow(dead_code)] // each test uses its own part

use std::sync::Arc;

use calibench::compensate::conditions::Conditions;
use calibench::compensate::{Desired, Target};
use calibench::effects::{Subject, build};
use calibench::identify::calibration::{Calibration, Estimate, MeasuredSetup};
use calibench::identify::fit::Outcome;
use calibench::identify::problem::Use;
use calibench::identify::{FittedRows, Model};
use calibench::math::Observability;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, Pose, Robot, built_in};
use calibench::units::{DEG, MM};
use nalgebra::{DMatrix, Point3, Vector3};
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

/// Points on the tool, m: its TCP, and one a metre along each of its axes.
const ON_TOOL: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The samples that a tracker would take of a point on the tool if all went well, under `calibration`.
fn measured(calibration: &Calibration, offset: &[f64; 3], reached: &[(Vec<f64>, Pose)], payload: usize) -> Dataset {
    let setup = &calibration.setups[0];
    let tool = FramePose::from_pose(&(setup.tool.pose() * Pose::translation(offset[0], offset[1], offset[2])));
    let sample = |(k, (q, world_from_tool)): (usize, &(Vec<f64>, Pose))| {
        let point = world_from_tool * Point3::from(Vector3::from(*offset));
        Sample {
            payload,
            time_s: Some(3600.0),
            approach: Some(vec![0; q.len()]),
            ..Sample::new(k.to_string(), q.clone(), Measured::Point(point.coords))
        }
    };
    Dataset {
        robot: calibration.robot.clone(),
        base: setup.base,
        tool,
        gravity: setup.gravity,
        payloads: setup.payloads.clone(),
        samples: reached.iter().enumerate().map(sample).collect(),
        ..Dataset::default()
    }
}

/// The largest error of any point on the tool, m, as the least-squares problem sees it.
pub fn largest_error(calibration: &Calibration, reached: &[(Vec<f64>, Pose)], payload: usize) -> f64 {
    let of = |offset: &[f64; 3]| {
        let dataset = measured(calibration, offset, reached, payload);
        // The identified TCP is moved along: else it would be taken for that of the point on the tool.
        let mut of_point = calibration.clone();
        let shift = calibration.setups[0].tool.pose().rotation * Vector3::from(*offset);
        let tool = of_point.estimates.iter_mut().filter(|e| e.effect == "tool_frame");
        tool.zip(shift.iter()).for_each(|(estimate, shift)| estimate.value += shift);
        let prediction = of_point.predict(&[NamedDataset::new("cell", &dataset)], Use::All).unwrap();
        assert!(prediction.refitted.is_empty() && prediction.from_fit_rows.is_empty(), "nothing is fitted to what is judged");
        prediction.residuals.iter().map(|r| r.norm()).fold(0.0, f64::max)
    };
    ON_TOOL.iter().map(of).fold(0.0, f64::max)
}
