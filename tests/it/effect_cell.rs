//! A cell in which every effect shows, made true to any model, and what a diagnosis finds in it.
#![allow(dead_code)] // each test uses its own part

use std::sync::Arc;

use calibench::diagnosis::{Diagnosis, diagnose};
use calibench::identify::Model;
use calibench::identify::problem::{Parameter, Problem, Use};
use calibench::measure::dataset::{Ball, Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, built_in, rotation_vector};
use calibench::units::{MM, UM};
use nalgebra::{Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Samples on balls, each on a ball of its own, and as many measured points.
pub const BALLS: usize = 60;

/// Length of the session, s.
pub const SESSION: f64 = 7200.0;

/// A cell in which every effect shows: balls and points all over the workspace, left-over readings of millimetres, two payloads, every
/// column filled.
pub fn cell() -> Dataset {
    let robot = Arc::new(built_in("kr6_r700").unwrap());
    let base = FramePose { xyz: [-0.5, 0.02, -0.06], rz_ry_rx: [0.3, 0.02, -0.01] };
    let tool = FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.1, -0.6, 0.8] };
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut between = |low: f64, high: f64| random.random_range(low..high);
    let mut balls = Vec::new();
    let mut samples = Vec::new();
    for k in 0..2 * BALLS {
        let q: Vec<f64> = robot.links.iter().map(|l| between(l.limits[0], l.limits[1])).collect();
        let pose = world_from_tool(&robot, &base, &tool, &q);
        let mut sample = if k % 2 == 0 {
            let reading = Vector3::from_fn(|_, _| between(-2.0, 2.0) * MM);
            let position = pose.transform_point(&reading.into()).coords;
            balls.push(Ball { id: format!("b{:03}", k / 2), position, sigma: 0.0, free: false });
            Sample::new(format!("b{:03}", k / 2), q, Measured::Ball { ball: k / 2, reading: Some(reading) })
        } else {
            Sample::new(format!("p{:03}", k / 2), q, Measured::Point(pose.translation.vector))
        };
        let mut sign = || if between(0.0, 1.0) < 0.5 { -1 } else { 1 };
        sample.approach = Some((0..6).map(|_| sign()).collect());
        sample.plungers = Some([sign(), sign(), sign()]);
        sample.q_commanded = Some(sample.q.iter().map(|q| q + between(-1e-4, 1e-4)).collect());
        sample.payload = k / 2 % 2;
        sample.time_s = Some(SESSION * (k + 1) as f64 / (2 * BALLS) as f64);
        sample.temp_c = Some(20.0 + between(0.0, 10.0));
        samples.push(sample);
    }
    let payload = |name: &str, mass: f64| Payload { name: name.into(), mass, com: Vector3::new(25.0, 0.0, -70.0) * MM };
    Dataset {
        robot,
        base,
        tool,
        payloads: vec![payload("heavy", 6.0), payload("light", 1.3)],
        balls,
        samples,
        // There is none, and the fit settles to a thousandth of what is stated.
        noise: Noise { ball: Some(0.01 * UM), point: Some(0.01 * UM), joint: Vec::new(), ..Noise::default() },
        ..Dataset::default()
    }
}

/// Makes the samples those of an arm whose parameters have these values (deviations, SI), to the last digits: points are moved, and
/// readings, since each ball is where it is.
pub fn make_true(data: &mut Dataset, model: &Model, values: &[f64]) {
    // Readings enter some effects, with thousandths of their size.
    for _ in 0..5 {
        let problem = Problem::new(&[NamedDataset::new("d", data)], model, Use::Fit).unwrap();
        let residuals = problem.residuals(values);
        let (robot, base, tool) = (data.robot.clone(), data.base, data.tool);
        for (sample, residual) in data.samples.iter_mut().zip(problem.orientation_residuals(values)) {
            if let (Some(orientation), Some(residual)) = (&mut sample.orientation, residual) {
                orientation.rotation = rotation_vector(&(Rotation3::new(-residual) * orientation.world_from_tool()));
            }
        }
        for (sample, residual) in data.samples.iter_mut().zip(residuals) {
            match &mut sample.measured {
                Measured::Point(point) => *point -= residual,
                Measured::Ball { reading: Some(reading), .. } => {
                    *reading += world_from_tool(&robot, &base, &tool, &sample.q).rotation.inverse() * residual;
                }
                _ => unreachable!("the cell has no other samples"),
            }
        }
    }
}

/// Measured quantity.
#[derive(Clone, Copy, PartialEq)]
pub enum Measures {
    /// Balls and points by turns.
    Both,
    /// The same in two sessions.
    TwoSessions,
    /// The balls alone.
    Balls,
}

/// What a diagnosis of a model with the base alone finds in a [measured cell](measured).
pub fn diagnosed(effect: &str, measures: Measures, size: impl Fn(&Parameter) -> f64) -> Diagnosis {
    diagnose(&[NamedDataset::new("d", &measured(effect, measures, size))], &Model::of(&["base_frame"])).unwrap()
}

/// A cell in which six balls are probed ten times each, when `effect` has these sizes, in plausible ones.
pub fn measured(effect: &str, measures: Measures, size: impl Fn(&Parameter) -> f64) -> Dataset {
    let mut data = cell();
    for (k, sample) in data.samples.iter_mut().enumerate() {
        if let Measured::Ball { ball, .. } = &mut sample.measured {
            *ball = k / 2 % 6;
        }
        sample.id = format!("s{k:03}");
        sample.approach = None;
        sample.plungers = None;
        sample.temp_c = None;
        if measures == Measures::TwoSessions {
            sample.session = Some(if k < BALLS { "first" } else { "second" }.into());
        }
    }
    if measures == Measures::Balls {
        data.samples.retain(|s| matches!(s.measured, Measured::Ball { .. }));
    }
    data.balls.truncate(6);
    data.noise = Noise { ball: Some(5.0 * UM), point: Some(5.0 * UM), joint: Vec::new(), ..Noise::default() };
    let model = Model::of(&["base_frame", effect]);
    let problem = Problem::new(&[NamedDataset::new("d", &data)], &model, Use::Fit).unwrap();
    let of = |p: &Parameter| if p.effect == effect { size(p) * p.spec.prior } else { 0.0 };
    let sizes: Vec<f64> = problem.parameters().iter().map(of).collect();
    make_true(&mut data, &model, &sizes);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for sample in &mut data.samples {
        let noise = Vector3::from_fn(|_, _| (random.random_range(-1.0..1.0) + random.random_range(-1.0..1.0)) * 6.0 * UM);
        match &mut sample.measured {
            Measured::Point(point) => *point += noise,
            Measured::Ball { reading: Some(reading), .. } => *reading += noise,
            _ => {}
        }
    }
    data
}
