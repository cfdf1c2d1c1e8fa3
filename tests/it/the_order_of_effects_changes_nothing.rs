//! The effects of a model file may stand in any order: fit, uncertainties, diagnosis and expected error are the same to the last bit.

use std::sync::Arc;

use calibench::diagnosis::{Examination, diagnose_examined};
use calibench::identify::calibration::Calibration;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::prediction::{WorkspaceError, WorkspacePoses};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, built_in};
use calibench::units::UM;
use nalgebra::Vector3;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const EFFECTS: [&str; 10] = [
    "base_frame",
    "mdh",
    "joint_compliance",
    "harmonic:2:13",
    "harmonic:2:4",
    "harmonic1:3",
    "joint_scale:1",
    "bearing_tilt:2",
    "error_curve:4:1:4",
    "outlier:p7",
];

fn data(random: &mut ChaCha8Rng) -> Dataset {
    let robot = Arc::new(built_in("kr6_r700").unwrap());
    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.05, 0.02, 0.15], ..FramePose::default() });
    let samples = (0..50).map(|k| {
        let q: Vec<f64> =
            robot.links.iter().map(|l| random.random_range(l.limits[0].max(-2.5)..l.limits[1].min(2.5))).collect();
        let bent: Vec<f64> = q.iter().map(|q| q + 1e-4 * (13.0 * q).sin()).collect();
        let seen = world_from_tool(&robot, &base, &tool, &bent).translation.vector;
        let noise = Vector3::from_fn(|_, _| 20.0 * UM * (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>());
        Sample::new(format!("p{k}"), q, Measured::Point(seen + noise))
    });
    let samples = samples.collect();
    let noise = Noise { point: Some(20.0 * UM), ..Noise::default() };
    Dataset { robot, base, tool, tool_free: true, noise, samples, ..Dataset::default() }
}

/// All that is said of a model: the parameters with their uncertainties, and what is expected and found.
fn said(named: &[NamedDataset<'_>], effects: &[&str]) -> (Calibration, WorkspaceError, Vec<u64>) {
    let model = Model::of(effects);
    let calibration = identify(named, &model).unwrap();
    let examination = Examination::new(named, &model).unwrap();
    let diagnosis = diagnose_examined(named, &examination).unwrap();
    let poses = WorkspacePoses::of(named);
    let error = WorkspaceError::predict(named, &examination, &poses).unwrap().expect("it can be predicted");
    let findings = diagnosis.findings.iter().map(|f| f.probability.to_bits());
    let figures = [calibration.rms, diagnosis.chi2_per_dof, diagnosis.nothing];
    (calibration, error, figures.iter().map(|x| x.to_bits()).chain(findings).collect())
}

#[test]
fn shuffled_effects_leave_every_figure_as_it_is() {
    let mut random = ChaCha8Rng::seed_from_u64(36);
    for _ in 0..3 {
        let data = data(&mut random);
        let named = [NamedDataset::new("campaign", &data)];
        let mut effects = EFFECTS;
        let (first, expected, figures) = said(&named, &effects);
        effects.shuffle(&mut random);
        let (again, expected_again, others) = said(&named, &effects);
        assert_eq!(first.estimates, again.estimates, "{effects:?}");
        assert_eq!(first.correlation, again.correlation, "{effects:?}");
        assert_eq!(expected, expected_again, "{effects:?}");
        assert_eq!(figures, others, "{effects:?}");
    }
}
