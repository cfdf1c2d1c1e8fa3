//! An arm whose description lists no masses gets guessed ones where it is read, and its compliance is fitted to them: held-out errors
//! fall although the true masses are others. The guess is marked, the mark and the numbers survive a file, and nothing that is a mass is
//! read off them.

use std::fs;
use std::sync::Arc;

use calibench::diagnosis::diagnose;
use calibench::effects::registry::Registry;
use calibench::identify::calibration::{read_calibration, write_calibration};
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::file::{read_dataset, write_dataset};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use calibench::residuals::Validation;
use calibench::robot::kinematics::{Posture, world_from_tool};
use calibench::robot::robot_file::{robot, to_toml};
use calibench::robot::sites::SiteIndex;
use calibench::robot::statics::{DEFAULT_GRAVITY, Loads, Payload};
use calibench::robot::{BUILT_IN, FramePose, Robot, built_in};
use calibench::units::UM;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Noise of a coordinate of a point, m.
const NOISE: f64 = 30.0 * UM;
/// Deflection of the loaded joints at a full torque, rad.
const DEFLECTION: f64 = 1.5e-3;
const TOOL: FramePose = FramePose { xyz: [0.06, 0.02, 0.15], rz_ry_rx: [0.0; 3] };

/// The robot as a file without masses describes it.
fn described(listed: &Robot) -> Robot {
    let folder = tempfile::tempdir().unwrap();
    let mut bare = listed.clone();
    bare.links.iter_mut().for_each(|link| (link.mass, link.com) = (0.0, Vector3::zeros()));
    fs::write(folder.path().join("arm.toml"), to_toml(&bare)).unwrap();
    robot("arm.toml", folder.path()).unwrap()
}

/// Points of an arm that bends under its listed masses, and of which only a description without masses is known.
fn bent(listed: &Robot) -> Dataset {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let n = listed.joints();
    let (mut posture, mut loads) = (Posture::new(listed), Loads::new(n));
    let nominal = vec![0.0; SiteIndex::new(n).len()];
    let postures: Vec<Vec<f64>> = (0..120)
        .map(|_| listed.links.iter().map(|l| 0.7 * random.random_range(l.limits[0].max(-3.0)..l.limits[1].min(3.0))).collect())
        .collect();
    let torques: Vec<Vec<f64>> = { postures.iter() }
        .map(|q| {
            posture.set(listed, &FramePose::default(), &TOOL, q, &nominal);
            loads.compute(listed, &posture, &Payload::none(), &DEFAULT_GRAVITY, &Vector3::zeros());
            loads.tau.clone()
        })
        .collect();
    let full = torques.iter().flatten().fold(0.0f64, |most, tau| most.max(tau.abs()));
    let one = |k: usize| {
        let (q, tau) = (&postures[k], &torques[k]);
        let turned: Vec<f64> = q.iter().zip(tau).map(|(q, tau)| q + DEFLECTION * tau / full).collect();
        let mut off = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>() * NOISE;
        let seen = world_from_tool(listed, &FramePose::default(), &TOOL, &turned).translation.vector;
        let set = if k % 3 == 2 { SampleSet::Validation } else { SampleSet::Fit };
        let seen = seen + Vector3::new(off(), off(), off());
        Sample { set, ..Sample::new(format!("p{k}"), q.clone(), Measured::Point(seen)) }
    };
    Dataset {
        samples: (0..postures.len()).map(one).collect(),
        robot: Arc::new(described(listed)),
        robot_reference: "arm.toml".into(),
        tool: TOOL,
        noise: Noise { point: Some(NOISE), ..Noise::default() },
        ..Dataset::default()
    }
}

/// Error of the rows held out, m rms.
fn held_out(dataset: &Dataset, model: &Model) -> f64 {
    let datasets = [NamedDataset::new("d", dataset)];
    let calibration = identify(&datasets, model).unwrap();
    Validation::of(&calibration.predict(&datasets, Use::Validation).unwrap()).unwrap().rms
}

#[test]
fn compliance_is_fitted_to_guessed_masses_and_held_out_errors_fall() {
    for name in BUILT_IN {
        let listed = built_in(name).unwrap();
        let data = bent(&listed);
        let model = Model::default_for(&data);
        assert!(data.robot.masses_guessed && model.holds("joint_compliance"), "{name}");
        let apart = { data.robot.links.iter() }.zip(&listed.links).map(|(a, b)| (a.mass - b.mass).abs()).fold(0.0, f64::max);
        assert!(apart > 0.5, "{name}: the true masses are others");
        let (rigid, with) = (held_out(&data, &Model::geometry()), held_out(&data, &model));
        assert!(with < 0.75 * rigid, "{name}: {:.1} um with compliance, {:.1} without", with / UM, rigid / UM);
    }
}

#[test]
fn the_guess_is_marked_and_survives_files() {
    let folder = tempfile::tempdir().unwrap();
    let data = bent(&built_in("kr6_r700").unwrap());
    let text = to_toml(&data.robot);
    assert!(text.contains("\nmasses = \"guessed\"\n"), "{text}");
    write_dataset(&data, &folder.path().join("d")).unwrap();
    let read = read_dataset(&folder.path().join("d")).unwrap();
    assert!(read.robot.masses_guessed && read.robot.is_same_arm(&data.robot));
    assert_eq!(to_toml(&read.robot), text, "the same after reading again");
    let mut bare = (*read.robot).clone();
    bare.links.iter_mut().for_each(|link| link.mass = 0.0);
    bare.masses_guessed = false;
    assert!(bare.is_same_arm(&read.robot) && !built_in("kr6_r700").unwrap().is_same_arm(&read.robot));
    let datasets = [NamedDataset::new("d", &read)];
    let calibration = identify(&datasets, &Model::default_for(&read)).unwrap();
    write_calibration(&calibration, &folder.path().join("c.toml")).unwrap();
    let back = read_calibration(&folder.path().join("c.toml"), Registry::catalogue()).unwrap();
    assert!(back.robot.masses_guessed && back.robot.is_same_arm(&data.robot));
    // The numbers of a file are kept, whatever another version would guess.
    let heavier = text.replacen("mass_kg = ", "mass_kg = 1", 1);
    fs::write(folder.path().join("other.toml"), &heavier).unwrap();
    let other = robot("other.toml", folder.path()).unwrap();
    assert!(other.masses_guessed && other.links[0].mass > 10.0, "{}", other.links[0].mass);
    let wrong = text.replacen("\"guessed\"", "\"weighed\"", 1);
    fs::write(folder.path().join("other.toml"), wrong).unwrap();
    assert_eq!(robot("other.toml", folder.path()).unwrap_err().field, "masses");
}

#[test]
fn no_mass_is_read_off_guessed_masses() {
    let data = bent(&built_in("kr6_r700").unwrap());
    let datasets = [NamedDataset::new("d", &data)];
    let model = Model::default_for(&data);
    let refused = identify(&datasets, &model.with("link_mass")).unwrap_err().to_string();
    assert!(refused.contains("guessed"), "{refused}");
    let of_mass = ["link_mass", "payload_mass", "payload_com"];
    let diagnosis = diagnose(&datasets, &model).unwrap();
    assert!(diagnosis.findings.iter().all(|f| !of_mass.iter().any(|id| f.hypothesis.effect == *id)));
}
