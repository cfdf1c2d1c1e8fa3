//! A zero that was lost by half a degree or more is named before anything else from thirty points of a tracker, and a good arm has
//! none, from twelve touches of one pin either. These have hardly more residuals than the arm has unknowns: they show such a zero in
//! seven arms of eight.
//!
//! The arms scatter by the plausible sizes of their links and gears.

use std::f64::consts::TAU;
use std::sync::Arc;

use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Ball, Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::residuals::misfit::abnormal;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM, UM, Unit};
use nalgebra::{Matrix3xX, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// How an arm is measured.
#[derive(Clone, Copy)]
enum Way {
    Pin,
    Tracker,
}

/// Joints whose zero neither base nor tool can take up.
const JOINTS: std::ops::RangeInclusive<usize> = 2..=5;

struct Trial {
    data: Dataset,
    lost: Vec<usize>,
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    let [u, v]: [f64; 2] = [random.random_range(1e-12..1.0), random.random_range(0.0..1.0)];
    (-2.0 * u.ln()).sqrt() * (TAU * v).cos()
}

/// The arm as it is: its links scatter as those of its kind.
fn as_built(robot: &Robot, random: &mut ChaCha8Rng) -> Robot {
    let mut truth = robot.clone();
    for link in &mut truth.links {
        link.mdh.alpha += 0.05 * DEG * normal(random);
        link.mdh.a += 0.3 * MM * normal(random);
        link.mdh.d += 0.3 * MM * normal(random);
        link.mdh.theta += 0.05 * DEG * normal(random);
    }
    truth
}

/// Joints at which the tool touches the pin, near `q`; `None` if the search fails.
fn touching(truth: &Robot, tool: &FramePose, pin: &Vector3<f64>, mut q: Vec<f64>) -> Option<Vec<f64>> {
    let base = FramePose::default();
    let at = |q: &[f64]| world_from_tool(truth, &base, tool, q).translation.vector;
    for _ in 0..60 {
        let off = pin - at(&q);
        if off.norm() < 1e-9 {
            let within = q.iter().zip(&truth.links).all(|(q, link)| (link.limits[0]..link.limits[1]).contains(q));
            return within.then_some(q);
        }
        let columns: Vec<Vector3<f64>> = (0..q.len())
            .map(|j| {
                let mut moved = q.clone();
                moved[j] += 1e-6;
                (at(&moved) - at(&q)) / 1e-6
            })
            .collect();
        let jacobian = Matrix3xX::from_columns(&columns);
        let inverse = (&jacobian * jacobian.transpose() + nalgebra::Matrix3::identity() * 1e-6).try_inverse()?;
        let step = jacobian.transpose() * inverse * off;
        let shorter = (0.3 / step.norm()).min(1.0);
        q.iter_mut().zip(step.iter()).for_each(|(q, step)| *q += shorter * step);
    }
    None
}

fn trial(way: Way, lost: usize, seed: u64) -> Trial {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let name = ["kr6_r700", "ur5", "ur10", "kr6_r700"][seed as usize % 4];
    let robot = Arc::new(built_in(name).unwrap());
    let mut truth = as_built(&robot, random);
    let mut joints: Vec<usize> = Vec::new();
    while joints.len() < lost {
        let joint = random.random_range(JOINTS);
        if !joints.contains(&joint) {
            joints.push(joint);
            let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
            truth.links[joint - 1].mdh.theta += sign * random.random_range(0.5..3.0) * DEG;
        }
    }
    let tool = FramePose { xyz: [0.022, 0.008, 0.15], ..FramePose::default() };
    let anywhere = |random: &mut ChaCha8Rng| -> Vec<f64> {
        truth.links.iter().map(|l| random.random_range(l.limits[0].max(-2.2)..l.limits[1].min(2.2))).collect()
    };
    let base = FramePose::default();
    match way {
        Way::Tracker => {
            let samples = (0..30).map(|k| {
                let q = anywhere(random);
                let seen = world_from_tool(&truth, &base, &tool, &q).translation.vector;
                let noise = Vector3::from_fn(|_, _| 50.0 * UM * normal(random));
                Sample::new(format!("s{k}"), q, Measured::Point(seen + noise))
            });
            let samples = samples.collect();
            let noise = Noise { point: seed.is_multiple_of(2).then_some(50.0 * UM), ..Noise::default() };
            Trial { data: Dataset { robot, base, tool, tool_free: true, noise, samples, ..Dataset::default() }, lost: joints }
        }
        Way::Pin => {
            let pin = Vector3::new(0.42, 0.05, 0.3);
            let mut samples = Vec::new();
            while samples.len() < 12 {
                // By eye, a tenth of a millimetre beside the pin.
                let beside = pin + Vector3::from_fn(|_, _| 0.1 * MM * normal(random));
                let Some(q) = touching(&truth, &tool, &beside, anywhere(random)) else { continue };
                samples.push(Sample::new(format!("s{}", samples.len()), q, Measured::Ball { ball: 0, reading: None }));
            }
            let balls = vec![Ball { id: "pin".into(), position: pin, free: true, sigma: 0.0 }];
            let noise = Noise { ball: Some(100.0 * UM), ..Noise::default() };
            Trial {
                data: Dataset { robot, base, tool, tool_free: true, noise, samples, balls, ..Dataset::default() },
                lost: joints,
            }
        }
    }
}

/// The joints whose zeros are named, and whether the first is a lost one.
fn named(trial: &Trial) -> (Vec<usize>, bool) {
    let model = Model::default_for(&trial.data);
    let found: Vec<usize> = match identify(&[NamedDataset::new("campaign", &trial.data)], &model) {
        Ok(calibration) => abnormal(&calibration).iter().filter_map(|a| a.zero_of).collect(),
        Err(_) => Vec::new(),
    };
    let first = found.first().is_some_and(|joint| trial.lost.contains(joint));
    (found, first)
}

/// Share of arms of which a lost zero is named first, and of good arms of which any is.
fn shares(way: Way, arms: u64, from: u64) -> [f64; 2] {
    let share = |lost: &(dyn Fn(u64) -> usize + Sync), said: &(dyn Fn(&Trial) -> bool + Sync)| {
        let count = (from..from + arms).into_par_iter().filter(|&seed| said(&trial(way, lost(seed), seed))).count();
        count as f64 / arms as f64
    };
    let found = share(&|seed| 1 + seed as usize % 2, &|trial| named(trial).1);
    let alarms = share(&|_| 0, &|trial| !named(trial).0.is_empty());
    [found, alarms]
}

#[test]
fn in_thirty_points_of_a_tracker() {
    let [found, alarms] = shares(Way::Tracker, 24, 3600);
    assert!(found >= 0.9 && alarms == 0.0, "{found} of the lost zeros, {alarms} of the good arms");
}

#[test]
fn in_twelve_touches_of_a_pin() {
    let [found, alarms] = shares(Way::Pin, 24, 3600);
    assert!(found >= 0.75 && alarms == 0.0, "{found} of the lost zeros, {alarms} of the good arms");
}

#[test]
fn touches_of_a_pin_are_no_reason_for_an_arm_without_length() {
    let worst = (3600..3624_u64).into_par_iter().map(|seed| {
        let trial = trial(Way::Pin, 1 + seed as usize % 2, seed);
        let fitted = identify(&[NamedDataset::new("campaign", &trial.data)], &Model::default_for(&trial.data));
        let lengths = fitted.iter().flat_map(|c| &c.estimates).filter(|e| e.effect == "mdh" && e.unit == Unit::MM);
        lengths.map(|e| (e.value - e.nominal).abs()).fold(0.0, f64::max)
    });
    let worst = worst.reduce(|| 0.0, f64::max);
    assert!(worst < 50.0 * MM, "{} mm", worst / MM);
}

/// The study behind both, two hundred arms of each.
#[test]
#[ignore = "a study: validation/run a_lost_zero_is_named"]
fn in_two_hundred_of_each() {
    for (name, way, least) in [("30 points of a tracker", Way::Tracker, 0.95), ("12 touches of a pin", Way::Pin, 0.85)] {
        let [found, alarms] = shares(way, 200, 7000);
        println!("{name}: a lost zero named first {:.1} %, good arms {:.1} %", 100.0 * found, 100.0 * alarms);
        assert!(found >= least && alarms <= 0.01, "{name}: {found}, {alarms}");
    }
}
