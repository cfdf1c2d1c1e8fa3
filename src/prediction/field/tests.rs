//! Robots with known errors, explained and judged.

use std::sync::Arc;
use std::time::Instant;

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

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

    fn worth(&self) -> (Worth, [f64; 2]) {
        let begin = Instant::now();
        let examination = self.examined();
        let examined = begin.elapsed();
        let field = Field::of(&self.named(), &examination).unwrap();
        let fitted = begin.elapsed();
        let worth = field.worth(&self.named(), &examination, &self.poses).unwrap();
        eprintln!(
            "examined {examined:?} field {:?} worth {:?}, {} groups, {} draws",
            fitted - examined,
            begin.elapsed() - fitted,
            field.campaign.groups.all.len(),
            field.draws.len()
        );
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
        (worth, left)
    }
}

fn show(name: &str, seed: u64, (worth, left): &(Worth, [f64; 2])) {
    eprintln!(
        "{name} {seed}: before {:.1} after {:.1} um ratio {:.3}; h {:.2} expected {:.1}/{:.1} own {:.1}/{:.1} open {}",
        left[0] / UM,
        left[1] / UM,
        left[1] / left[0],
        worth.before.leverage,
        worth.before.measured / UM,
        worth.after.measured / UM,
        worth.before.own / UM,
        worth.after.own / UM,
        worth.gate.is_open()
    );
    for c in worth.gate.conditions.iter().filter(|c| !c.holds()) {
        eprintln!("   fails {c:?}");
    }
    eprintln!("   {:?}", &worth.shares[..worth.shares.len().min(4)]);
}

#[test]
fn a_joint_that_errs_by_two_angles_is_corrected() {
    for seed in 1..=2 {
        let known = Known::by_two_angles(seed, 80);
        show("S13", seed, &known.worth());
        let known = Known::perfect(seed, 80);
        show("none", seed, &known.worth());
    }
}
