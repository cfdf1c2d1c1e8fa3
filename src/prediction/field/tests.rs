//! Robots with known errors, explained and judged.

use std::sync::Arc;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::gate::Matter;
use super::*;
use crate::identify::Model;
use crate::measure::dataset::{Dataset, Measured as Reading, Noise, Sample};
use crate::prediction::at_new_poses::AtNewPoses;
use crate::prediction::chance::normal;
use crate::prediction::workspace::workspace_poses;
use crate::robot::kinematics::world_from_tool;
use crate::robot::{FramePose, Robot, built_in};
use crate::units::{MM, MRAD, UM};

/// Noise of a coordinate, m.
const NOISE: f64 = 10.0 * UM;

/// Errors of the joints' angles at joint angles, rad.
type Errors = dyn Fn(&[f64]) -> Vec<f64>;

/// A robot with links off by ordinary amounts whose joints err, its measured points, and postures with the true positions.
struct Known {
    data: Dataset,
    poses: Vec<Vec<f64>>,
    truth: Vec<Vector3<f64>>,
}

impl Known {
    fn new(seed: u64, samples: usize, errors: &Errors) -> Self {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let robot = built_in("kr6_r700").unwrap();
        let mut real: Robot = robot.clone();
        for link in &mut real.links {
            link.mdh.alpha += 0.5 * MRAD * normal(random);
            link.mdh.theta += 0.5 * MRAD * normal(random);
            link.mdh.a += 0.2 * MM * normal(random);
            link.mdh.d += 0.2 * MM * normal(random);
        }
        let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.0, -0.125], ..FramePose::default() });
        let reached = |q: &[f64]| -> Vector3<f64> {
            let q: Vec<f64> = q.iter().zip(errors(q)).map(|(q, e)| q + e).collect();
            world_from_tool(&real, &base, &tool, &q).translation.vector
        };
        let mut data = Dataset {
            robot: Arc::new(robot),
            robot_reference: "kr6_r700".into(),
            base,
            tool,
            noise: Noise { point: Some(NOISE), ..Noise::default() },
            ..Dataset::default()
        };
        let all = workspace_poses(&data, 300);
        let mut order: Vec<usize> = (0..all.len()).collect();
        rand::seq::SliceRandom::shuffle(&mut order[..], random);
        let measured = order[..samples].iter().map(|&k| {
            let noise = Vector3::from_fn(|_, _| NOISE * normal(random));
            Sample::new(format!("p{k}"), all[k].clone(), Reading::Point(reached(&all[k]) + noise))
        });
        data.samples = measured.collect();
        let poses: Vec<Vec<f64>> = order[samples..].iter().map(|&k| all[k].clone()).collect();
        let truth = poses.iter().map(|q| reached(q)).collect();
        Known { data, poses, truth }
    }

    /// Two angles at once: joint 1 errs by those of joints 1 and 3.
    fn by_two_angles(seed: u64, samples: usize) -> Self {
        let random = &mut ChaCha8Rng::seed_from_u64(seed ^ 0xff);
        let [p, r] = [0; 2].map(|_| random.random_range(0.0..6.28));
        let size = 1e-4 * random.random_range(1.0..4.0);
        let errors = move |q: &[f64]| {
            let mut errors = vec![0.0; q.len()];
            errors[0] = size * (2.0 * q[0] + p).sin() * (2.0 * q[2] + r).sin();
            errors
        };
        Known::new(seed, samples, &errors)
    }

    fn perfect(seed: u64, samples: usize) -> Self {
        Known::new(seed, samples, &|q| vec![0.0; q.len()])
    }

    fn named(&self) -> [NamedDataset<'_>; 1] {
        [NamedDataset::new("known", &self.data)]
    }

    fn examined(&self) -> Examination {
        Examination::new(&self.named(), &Model::paper()).unwrap()
    }

    /// The worth of the field, and the true mean error of the model alone and of the model with its field, m.
    fn judged(&self) -> (Field, Worth, [f64; 2]) {
        let examination = self.examined();
        let field = Field::of(&self.named(), &examination).unwrap();
        let worth = field.worth(&self.named(), &examination, &self.poses).unwrap();
        let random = &mut ChaCha8Rng::seed_from_u64(1);
        let mut there = at_poses(&self.data, &examination, &self.poses, random);
        for (sample, truth) in there.samples.iter_mut().zip(&self.truth) {
            sample.measured = Reading::Point(*truth);
        }
        let missed = AtNewPoses::of_the_arm(&there, &examination).unwrap().residuals();
        let left = |moved: &[Vector3<f64>]| {
            moved.iter().zip(&missed).map(|(by, missed)| (missed - by).norm()).sum::<f64>() / missed.len() as f64
        };
        let left = [left(&worth.alone), left(&worth.corrected)];
        (field, worth, left)
    }
}

fn failing(worth: &Worth) -> Vec<Matter> {
    worth.gate.conditions.iter().filter(|c| !c.holds()).map(|c| c.matter).collect()
}

#[test]
fn a_joint_that_errs_by_two_angles_is_corrected_and_named() {
    let known = Known::by_two_angles(2, 80);
    let (field, worth, [before, after]) = known.judged();
    assert!(worth.gate.is_open(), "{:?}", worth.gate);
    assert!(after < 0.6 * before, "{before} {after}");
    assert_eq!(worth.shares[0].0, Part::Angles { joint: 0, of: [0, 2] });
    assert!(worth.shares[0].1 > 0.7 && (worth.shares.iter().map(|s| s.1).sum::<f64>() - 1.0).abs() < 1e-9);
    // What is said holds the truth: the instrument's noise is in it.
    for (said, true_error) in [(worth.before, before), (worth.after, after)] {
        let measured = true_error.hypot(1.6 * NOISE);
        let sigmas = (said.level() / measured).ln() / said.spread;
        assert!(!said.is_refused() && (-2.0..3.0).contains(&sigmas), "{said:?} {measured}");
    }
    // The table alone gives what the joints move, and it is small.
    let Correction { table, parameters, effects } = field.correction();
    assert!(serde_json::to_string(&table).unwrap().len() < 100_000);
    let examination = known.examined();
    assert_eq!((parameters.len(), effects.len()), (examination.fitted.len(), examination.columns.len()));
    let random = &mut ChaCha8Rng::seed_from_u64(SEED);
    let there = at_poses(&known.data, &examination, &known.poses, random);
    let at = AtNewPoses::of_the_arm(&there, &examination).unwrap();
    let sizes: Vec<f64> = parameters.iter().chain(&effects).copied().collect();
    let by_columns = at.fields() * DVector::from_vec(sizes);
    for (p, c) in at.plain_circumstances().iter().enumerate() {
        let turned = table.errors(&c.q, &c.tau);
        let by_joints: Vector3<f64> =
            turned.iter().zip(&c.joints).map(|(angle, column)| column.fixed_rows::<3>(0) * *angle).sum();
        let moved = by_columns.fixed_rows::<3>(3 * p) + by_joints;
        assert!((moved - worth.corrected[p]).norm() < 0.1 * UM, "{p}");
    }
}

#[test]
fn a_robot_whose_joints_do_not_err_keeps_its_model() {
    let (_, worth, [before, after]) = Known::perfect(1, 60).judged();
    assert!(!worth.gate.is_open() && failing(&worth).contains(&Matter::OwnRatio), "{:?}", worth.gate);
    assert!(after < 1.3 * before, "{before} {after}");
}

#[test]
fn fields_are_the_same_on_one_thread_and_on_two() {
    let known = Known::by_two_angles(5, 210);
    let examination = known.examined();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let field = Field::of(&known.named(), &examination).unwrap();
            (field.correction(), field.divisions.clone(), field.draws[0].clone())
        })
    };
    let [one, two] = [1, 2].map(on);
    assert!(one == two);
}

#[test]
fn what_carries_no_field_is_an_error_by_name() {
    let said = |known: &Known, model: &Model, change: fn(&mut Examination)| {
        let mut examination = Examination::new(&known.named(), model).unwrap();
        change(&mut examination);
        let field = Field::of(&known.named(), &examination);
        field.and_then(|f| f.worth(&known.named(), &examination, &[]).map(drop)).unwrap_err().to_string()
    };
    let enough = Known::perfect(3, 24);
    let as_fitted = |_: &mut Examination| {};
    assert!(said(&enough, &Model::paper(), as_fitted).contains("name at least one"));
    assert!(said(&Known::perfect(3, 19), &Model::paper(), as_fitted).contains("19 postures are too few"));
    assert!(said(&enough, &Model::of(&["base_frame", "tool_frame"]), as_fitted).contains("does not hold 'mdh'"));
    let stopped = |e: &mut Examination| e.fit.outcome = Outcome::IterationLimit;
    assert!(said(&enough, &Model::paper(), stopped).contains("did not converge"));
}

/// Times and ratios on robots of many seeds: `cargo test --release -p calibench --lib field -- --ignored --nocapture`.
#[test]
#[ignore = "a study: it prints and judges nothing"]
fn robots_of_many_seeds() {
    for samples in [40, 80, 200, 260] {
        for seed in 700..704 {
            for (name, known) in
                [("two angles", Known::by_two_angles(seed, samples)), ("perfect", Known::perfect(seed, samples))]
            {
                let examination = known.examined();
                let begin = std::time::Instant::now();
                let field = Field::of(&known.named(), &examination).unwrap();
                let fitted = begin.elapsed();
                field.worth(&known.named(), &examination, &known.poses).unwrap();
                let judged = begin.elapsed() - fitted;
                let Campaign { rows, groups, y, stated, .. } = &field.campaign;
                let begin = std::time::Instant::now();
                let weights = vec![1.0; rows.samples.len()];
                evidence::of_groups(rows, groups, y, &weights, *stated).unwrap();
                let evidence = begin.elapsed();
                let (_, worth, [before, after]) = known.judged();
                println!(
                    "{samples} {seed} {name}: {:.1} {:.1} um, ratio {:.3}, open {}, h {:.2}, said {:.1} {:.1}; field {fitted:.1?}, worth {judged:.1?}, evidence {evidence:.1?}",
                    before / UM,
                    after / UM,
                    after / before,
                    worth.gate.is_open(),
                    worth.before.leverage,
                    worth.before.level() / UM,
                    worth.after.level() / UM,
                );
            }
        }
    }
}
