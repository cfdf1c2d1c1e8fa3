//! The residual of a calibration is that of its file on the same rows, and a larger model never fits worse, also where effects act through
//! compliances and the payload makes most of the torques.

use std::path::Path;
use std::sync::Arc;

use calibench::effects::registry::Registry;
use calibench::identify::calibration::Calibration;
use calibench::identify::calibration::{read_calibration, write_calibration};
use calibench::identify::fit::{Fit, Outcome, check_nested, fit, fit_larger, independent_parameters};
use calibench::identify::problem::{Problem, Use};
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{MM, UM};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

const SAMPLES: usize = 60;

/// One-sigma of a coordinate, m.
const NOISE: f64 = 20.0 * UM;

/// Effects that are added to the paper's model, alone and in pairs.
const EXTRAS: [&str; 6] = ["payload_mass", "payload_com", "link_mass", "gravity_direction", "stiffening", "harmonic1:2"];

/// Effects of the truth in addition to the paper's model.
const TRUTH: [&str; 9] = [
    "base_frame",
    "mdh",
    "joint_compliance",
    "payload_mass",
    "payload_com",
    "gravity_direction",
    "link_mass",
    "harmonic1:3",
    "bearing_tilt:2",
];

/// A robot whose links weigh `links` times as much, carries `entered` and in truth `extra` more, its errors being `size` times plausible.
struct Case {
    robot: &'static str,
    links: f64,
    entered: f64,
    extra: f64,
    size: f64,
    seed: u64,
}

fn cases() -> Vec<Case> {
    let case = |(k, (robot, links, entered, extra, size))| Case { robot, links, entered, extra, size, seed: 40 + k as u64 };
    let all = [
        ("kr6_r700", 1.0, 6.0, 0.5, 1.0),
        ("kr6_r700", 1.0, 1.0, 12.0, 2.0),
        ("ur10", 1.0, 2.0, 8.0, 3.0),
        ("ur10", 0.3, 10.0, -9.0, 3.0),
        ("kr6_r700", 10.0, 2.0, 60.0, 4.0),
        ("ur10", 6.0, 5.0, 100.0, 4.0),
    ];
    all.into_iter().enumerate().map(case).collect()
}

/// Nearly normal, of [`NOISE`].
fn noise(between: &mut dyn FnMut(f64, f64) -> f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| NOISE * (0..12).map(|_| between(-0.5, 0.5)).sum::<f64>())
}

/// Points all over the workspace where the nominal arm puts them, the joints as they are read.
fn nominal(case: &Case, between: &mut dyn FnMut(f64, f64) -> f64) -> Dataset {
    let mut robot: Robot = built_in(case.robot).unwrap();
    robot.links.iter_mut().for_each(|link| link.mass *= case.links);
    let robot = Arc::new(robot);
    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.05, 0.02, 0.2], ..FramePose::default() });
    let sample = |k: usize| {
        let q: Vec<f64> = robot.links.iter().map(|l| between(l.limits[0].max(-3.0), l.limits[1].min(3.0))).collect();
        let at = world_from_tool(&robot, &base, &tool, &q).translation.vector;
        Sample::new(format!("p{k:03}"), q, Measured::Point(at))
    };
    let samples = (0..SAMPLES).map(sample).collect();
    let payload = Payload { name: "load".into(), mass: case.entered, com: Vector3::new(0.05, 0.0, 0.1) };
    Dataset {
        robot: robot.clone(),
        base,
        tool,
        payloads: vec![payload],
        samples,
        noise: Noise { ball: None, point: Some(NOISE), joint: Vec::new(), ..Noise::default() },
        robot_reference: "scaled".into(),
        ..Dataset::default()
    }
}

/// Makes the points those of a robot that leaves `residuals`, with noise.
fn measure(data: &mut Dataset, residuals: &[Vector3<f64>], between: &mut dyn FnMut(f64, f64) -> f64) {
    for (sample, residual) in data.samples.iter_mut().zip(residuals) {
        let noise = noise(between);
        if let Measured::Point(point) = &mut sample.measured {
            *point += noise - residual;
        }
    }
}

/// Points measured on the robot of a case.
fn campaign(case: &Case) -> Dataset {
    let mut random = ChaCha8Rng::seed_from_u64(case.seed);
    let mut between = |low: f64, high: f64| random.random_range(low..high);
    let mut data = nominal(case, &mut between);
    let truth = Model::of(&TRUTH);
    let residuals = {
        let problem = Problem::new(&[NamedDataset::new("d", &data)], &truth, Use::Fit).unwrap();
        let mut values = problem.start();
        for (value, p) in values.iter_mut().zip(problem.parameters()) {
            *value = match p.effect.whole() {
                "payload_mass" => case.extra,
                // Heavier arms have stiffer gears.
                "joint_compliance" => 0.3 * case.size * p.spec.prior * between(0.5, 1.5) / (case.links + case.entered / 10.0),
                _ => case.size * p.spec.prior * between(-1.0, 1.0),
            };
        }
        problem.residuals(&values)
    };
    measure(&mut data, &residuals, &mut between);
    data
}

/// Of parameters of the paper's model, fitted to robots that also have `lacking`: shares of 95 % intervals, with what the model lacks and by
/// noise alone, that hold the truth.
fn coverage(lacking: &[&str], robots: u64) -> [f64; 2] {
    let (mut held, mut all) = ([0.0; 2], 0.0);
    for seed in 0..robots {
        let case = Case { robot: "kr6_r700", links: 1.0, entered: 6.0, extra: 0.0, size: 1.0, seed: 700 + seed };
        let mut random = ChaCha8Rng::seed_from_u64(case.seed);
        let mut between = |low: f64, high: f64| random.random_range(low..high);
        let mut data = nominal(&case, &mut between);
        let problem =
            Problem::new(&[NamedDataset::new("d", &data)], &lacking.iter().fold(Model::paper(), |m, e| m.with(e)), Use::Fit)
                .unwrap();
        let told = independent_parameters(&Problem::new(&[NamedDataset::new("d", &data)], &Model::paper(), Use::Fit).unwrap())
            .unwrap();
        let mut truth = problem.start();
        for (k, p) in problem.parameters().iter().enumerate() {
            if told.contains(&k) || lacking.contains(&p.effect.whole()) {
                truth[k] = p.spec.prior * 2.0 * between(-1.0, 1.0);
            }
        }
        let residuals = problem.residuals(&truth);
        let of = |name: &str| {
            problem.parameters().iter().position(|p| p.name == name).map(|k| problem.parameters()[k].start + truth[k])
        };
        let truths: Vec<(String, f64)> = problem.parameters().iter().map(|p| (p.name.clone(), of(&p.name).unwrap())).collect();
        measure(&mut data, &residuals, &mut between);
        let c = identify(&[NamedDataset::new("d", &data)], &Model::paper()).unwrap();
        for e in &c.estimates {
            let truth = truths.iter().find(|(name, _)| *name == e.name).unwrap().1;
            for (held, sigma) in held.iter_mut().zip([e.sigma, e.sigma_noise]) {
                *held += f64::from(u8::from((e.value - truth).abs() <= 1.96 * sigma));
            }
            assert!(e.sigma >= e.sigma_noise, "{}: surer than the noise", e.name);
            all += 1.0;
        }
    }
    held.map(|held| held / all)
}

#[test]
fn intervals_hold_the_truth_when_the_model_lacks_something() {
    let cases: [(&str, &[&str], f64); 5] = [
        ("nothing", &[], 0.93),
        ("harmonic1:1", &["harmonic1:1"], 0.85),
        ("harmonic1:2 and :6", &["harmonic1:2", "harmonic1:6"], 0.85),
        ("bearing_tilt:2", &["bearing_tilt:2"], 0.8),
        ("four", &["harmonic1:1", "stiffening", "bearing_tilt:1", "harmonic2:4"], 0.8),
    ];
    let mut wrong = Vec::new();
    for (name, lacking, least) in cases {
        let [with, noise_alone] = coverage(lacking, 12);
        println!("{name}: {with:.3} hold the truth, by noise alone {noise_alone:.3}");
        if with < least {
            wrong.push(format!("{name}: {with:.3}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn models() -> Vec<Vec<&'static str>> {
    let alone = EXTRAS.iter().map(|&e| vec![e]);
    let pairs = EXTRAS.iter().enumerate().flat_map(|(k, &a)| EXTRAS[k + 1..].iter().map(move |&b| vec![a, b]));
    alone.chain(pairs).collect()
}

fn paper_and(extras: &[&str]) -> Model {
    extras.iter().fold(Model::paper(), |model, extra| model.with(extra))
}

fn rms(c: &Calibration, data: &Dataset) -> f64 {
    let residuals = c.predict(&[NamedDataset::new("d", data)], Use::Fit).unwrap().residuals;
    (residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / residuals.len() as f64).sqrt()
}

/// Faults of one model of a case.
fn judge(data: &Dataset, extras: &[&str], smaller: &[(&Problem, &Fit)], file: &Path) -> (Problem, Fit, Vec<String>) {
    let named = [NamedDataset::new("d", data)];
    let model = paper_and(extras);
    let problem = Problem::new(&named, &model, Use::Fit).unwrap();
    let mut found = fit(&problem).unwrap();
    let mut wrong = Vec::new();
    for (small, before) in smaller {
        if let Err(e) = check_nested(before, &found) {
            println!("{extras:?} from the nominal start: {e}");
            match fit_larger(&problem, small, before) {
                Ok(better) => found = better,
                // A fit that left the range of its effects says so, and promises nothing.
                Err(_) if found.outcome == Outcome::LeftLinearRange => {}
                Err(e) => wrong.push(e.to_string()),
            }
        }
    }
    let c = Calibration::of(&named, &model, &problem, &found);
    write_calibration(&c, file).unwrap();
    let read = rms(&read_calibration(file, Registry::catalogue()).unwrap(), data);
    if (read - c.rms).abs() > 1e-6 * c.rms {
        wrong.push(format!("{:.6} mm printed, {:.6} mm read back", c.rms / MM, read / MM));
    }
    if found.outcome == Outcome::Stalled {
        wrong.push(format!("{:?} after {} steps, {:.4} mm", found.outcome, found.iterations, found.rms / MM));
    }
    println!("{extras:?}: {:.4} mm, chi2 {:.3}, {:?}, {} steps", found.rms / MM, found.chi2, found.outcome, found.iterations);
    (problem, found, wrong)
}

#[test]
fn what_is_printed_is_what_the_file_leaves_and_more_never_fits_worse() {
    let judged = cases().into_par_iter().enumerate().map(|(k, case)| {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("calibration.toml");
        let data = campaign(&case);
        println!("case {k}");
        let (small, before, mut wrong) = judge(&data, &[], &[], &file);
        let mut fits: Vec<(Vec<&str>, Problem, Fit)> = Vec::new();
        for extras in models() {
            let nested = fits.iter().filter(|(one, ..)| extras.len() == 2 && one.len() == 1 && extras.contains(&one[0]));
            let smaller: Vec<_> = nested.map(|(_, p, f)| (p, f)).chain([(&small, &before)]).collect();
            let (problem, found, what) = judge(&data, &extras, &smaller, &file);
            wrong.extend(what.into_iter().map(|what| format!("case {k} {extras:?}: {what}")));
            fits.push((extras, problem, found));
        }
        wrong
    });
    let wrong: Vec<String> = judged.collect::<Vec<_>>().concat();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases().len() * (models().len() + 1), wrong.join("\n"));
}
