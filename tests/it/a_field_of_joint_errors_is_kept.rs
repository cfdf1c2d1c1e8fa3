//! What no named effect explains is recommended as a field of joint errors, written to the model file, and found again by whoever
//! reads it.

use std::f64::consts::TAU;
use std::sync::Arc;

use calibench::effects::EffectId;
use calibench::effects::Subject;
use calibench::effects::registry::Registry;
use calibench::identify::calibration::{read_calibration, write_calibration};
use calibench::identify::model_file::{read_model, write_model};
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use calibench::nalgebra::Vector3;
use calibench::prediction::{WorkspacePoses, workspace_poses};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, built_in};
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{Ladder, ladder};
use calibench::selection::recommend::ChoiceKind;
use calibench::units::{MM, UM};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Noise of a coordinate, m.
const NOISE: f64 = 15.0 * UM;

/// A UR5 of which three joints err by two pairs of angles each, measured at `samples` postures, and at 100 of set `validation`.
fn erring(seed: u64, samples: usize) -> Dataset {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let robot = built_in("ur5").unwrap();
    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.05, 0.0, 0.1], ..FramePose::default() });
    let waves: Vec<_> = (0..6)
        .map(|k| {
            let a = random.random_range(0..4);
            let b = a + 1 + random.random_range(0..4 - a);
            let [p, r] = [0; 2].map(|_| random.random_range(0.0..TAU));
            (k / 2, a, b, p, r, 1e-4 * random.random_range(1.0..2.5))
        })
        .collect();
    let reached = |q: &[f64]| {
        let mut off = q.to_vec();
        for (joint, a, b, p, r, size) in &waves {
            off[*joint] += size * (q[*a] + p).sin() * (2.0 * q[*b] + r).sin();
        }
        world_from_tool(&robot, &base, &tool, &off).translation.vector
    };
    let mut data = Dataset {
        robot: Arc::new(robot.clone()),
        robot_reference: "ur5".into(),
        base,
        tool,
        noise: Noise { point: Some(NOISE), ..Noise::default() },
        hash: format!("{seed:064}"),
        ..Dataset::default()
    };
    let poses = workspace_poses(&data, samples + 100);
    let sample = |(k, q): (usize, &Vec<f64>)| {
        let noise = Vector3::from_fn(|_, _| NOISE * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, random));
        let mut sample = Sample::new(format!("p{k}"), q.clone(), Measured::Point(reached(q) + noise));
        // Every third pose or so is kept for the judgement.
        sample.set = if k % (samples + 100) >= samples { SampleSet::Validation } else { SampleSet::Fit };
        sample
    };
    data.samples = poses.iter().enumerate().map(sample).collect();
    data
}

fn climbed(data: &Dataset) -> Ladder {
    let named = [NamedDataset::new("erring", data)];
    let poses = WorkspacePoses::of(&named);
    ladder(&named, &Model::default_for(data), HoldOut { poses: &poses, checks: &[], worker: None }).unwrap()
}

#[test]
fn it_is_recommended_written_and_read_back() {
    let data = erring(11, 120);
    let named = [NamedDataset::new("erring", &data)];
    let ladder = climbed(&data);
    assert_eq!(ladder.kind(), ChoiceKind::Field, "{:?}", ladder.recommendation.choices);
    let (first, chosen) = (ladder.first(), ladder.recommended());
    let rms = |step: &calibench::selection::ladder::LadderStep| step.validation.as_ref().unwrap().rms;
    assert!(rms(chosen) < 0.6 * rms(first), "{} {}", rms(chosen) / MM, rms(first) / MM);
    // What is expected there, noise included, is what is found.
    let expected = chosen.workspace.as_ref().unwrap().mean_as_measured();
    let measured = chosen.validation.as_ref().unwrap().mean;
    assert!((0.7..1.4).contains(&(expected / measured)), "{} {}", expected / MM, measured / MM);

    let folder = tempfile::tempdir().unwrap();
    let [model, calibration] = ["model.toml", "calibration.toml"].map(|name| folder.path().join(name));
    write_model(&chosen.model, &model).unwrap();
    let read = read_model(&model, &Subject::new(&data.robot, &[])).unwrap();
    assert_eq!(read.field, chosen.model.field);
    let again = identify(&named, &read).unwrap();
    write_calibration(&again, &calibration).unwrap();
    assert!(std::fs::metadata(&calibration).unwrap().len() < 100_000, "a calibration stays small");
    let back = read_calibration(&calibration, Registry::catalogue()).unwrap();
    assert!((back.estimate("error_field.share").unwrap().value - 1.0).abs() < 1e-3);
    let [by_ladder, by_file] = [&chosen.calibration, &back].map(|c| c.predict(&named, Use::Validation).unwrap().residuals);
    for (a, b) in by_ladder.iter().zip(&by_file) {
        assert!((a - b).norm() < 1e-9, "{a} {b}");
    }
    // Another's data, or none of its table, is told apart.
    let without = Model { field: None, ..read.clone() };
    let error = identify(&named, &without).unwrap_err().to_string();
    assert!(error.contains("error_field") && error.contains("calibench ladder"), "{error}");
}

#[test]
fn it_is_judged_by_what_it_did_not_see() {
    let data = erring(12, 120);
    let named = [NamedDataset::new("erring", &data)];
    let chosen = climbed(&data);
    let chosen = chosen.recommended();
    assert!(chosen.model.lists(EffectId::ERROR_FIELD));
    let measured = chosen.validation.as_ref().unwrap().rms;
    // Left-out blocks are predicted about as the validation rows are, and never as well as the fitted rows.
    assert!((0.7..1.6).contains(&(chosen.cross_validated / measured)), "{} {measured}", chosen.cross_validated);
    assert!(chosen.cross_validated > chosen.fit);
    // The same file on the same data gives the same figures.
    let poses = WorkspacePoses::of(&named);
    let ground = HoldOut { poses: &poses, checks: &[], worker: None };
    let again = calibench::selection::ladder::ladder_step(&named, &chosen.model, ground).unwrap();
    assert_eq!(again.cross_validated, chosen.cross_validated);
    assert_eq!(again.workspace, chosen.workspace);
}
