//! A true error of ball, gauge, tracker, joints or one sample is located there by a model that knows the effect.

use calibench::measure::dataset::NamedDataset;
use std::path::Path;

use calibench::identify::calibration::Calibration;
use calibench::identify::{Model, identify};
use calibench_sim::ground_truth::{Met, ground_truth};
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::measure_all;
use calibench_sim::scenario::{Scenario, load_scenario};

/// The cell of Table 8, measured by the mixed campaign from a small pool.
fn cell() -> Scenario {
    let mut cell = load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/table8.toml")).unwrap();
    (cell.plan.poses_per_ball, cell.plan.reversed_poses, cell.plan.light_poses, cell.plan.point_poses) = (15, 30, 30, 40);
    (cell.plan.pool_per_ball, cell.plan.starts, cell.tracker.validation_poses) = (200, 1, 1);
    cell
}

/// Calibrates with a model that has this effect besides the 31 parameters, on a cell whose truth contains it with these keys.
fn with_effect(cell: &Scenario, plans: &Plans, id: &str, keys: &[(&str, f64)]) -> Calibration {
    let mut truth = cell.truth().keys().clone();
    truth.effects.insert(id.into(), keys.iter().map(|(key, value)| ((*key).to_owned(), *value)).collect());
    let scenario = cell.with_truth(truth).unwrap();
    let measured = measure_all(&scenario, Streams { seed: 1, trial: 0 }, plans, &mut ()).unwrap();
    identify(&[NamedDataset::new("mixed", &measured.fit)], &Model::of(&["base_frame", "mdh", "joint_compliance", id])).unwrap()
}

#[test]
fn each_is_found_at_its_size() {
    let cell = cell();
    let plans = Plans::new(&cell, 1).unwrap();
    // Sizes in the unit of the key; `missing` is the share that may be missing, in addition to four sigma: the friction state
    // of a joint or a plunger does not reverse at once, whereas the model takes the sign of the last motion. Statements about
    // the end of a session are as accurate as the estimate of its length.
    for (id, key, size, parameter, missing) in [
        ("ball:3", "x_mm", 0.15, "ball:3.x", 0.0),
        ("stiction", "2_um", -6.0, "stiction.2", 0.5),
        ("tracker_registration", "z_um", 120.0, "tracker_registration.z", 0.0),
        ("hysteresis:1", "h_urad", -60.0, "hysteresis:1.h", 0.15),
        ("outlier:p07", "y_mm", 0.4, "outlier:p07.y", 0.0),
        ("thermal_joint:4", "b_urad", 250.0, "thermal_joint:4.b", 0.15),
        ("joint_step:3:600", "s_urad", 160.0, "joint_step:3:600.s", 0.0),
        ("payload_mass", "m_kg", 0.6, "payload_mass.m", 0.1),
        ("pedestal", "x_urad_per_nm", 7.0, "pedestal.x", 0.05),
    ] {
        let calibration = with_effect(&cell, &plans, id, &[(key, size)]);
        let found = calibration.estimate(parameter).unwrap_or_else(|| panic!("{id}: no {parameter}"));
        let (value, sigma) = (found.unit.from_si(found.value - found.nominal), found.unit.from_si(found.sigma));
        let allowed = missing * size.abs() + 4.0 * sigma;
        println!("{id}: {value:.4} +- {sigma:.4} for {size}");
        assert!((value - size).abs() < allowed && sigma < 0.25 * size.abs(), "{id}: {value} +- {sigma} for {size}");
    }
}

/// An effect defined by the scenario itself, in its truth: joint 3 ripples 5.5 times per turn, as no effect of the
/// catalogue does.
const OWN: &str = r#"
format = "calibench-scenario/1"
extends = "TABLE8"
name = "own"
question = "Is what the user suspects there?"
seed = 1

[plan]
poses_per_ball = 15
pool_per_ball = 200
starts = 1

[tracker]
validation_poses = 40

[[effect]]
name = "belt"
unit = "urad"
candidate = true
terms = [{ site = "theta:3", basis = "sin(5.5*q3)", group = "sin" }, { site = "theta:3", basis = "cos(5.5*q3)", group = "cos" }]

[truth.effects.belt]
sin_urad = 150.0
cos_urad = -100.0
"#;

fn own_scenario(text: &str) -> Result<Scenario, calibench::files::FileError> {
    let folder = tempfile::tempdir().unwrap();
    let table8 = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/table8.toml").canonicalize().unwrap();
    let path = folder.path().join("own.toml");
    std::fs::write(&path, text.replace("TABLE8", table8.to_str().unwrap())).unwrap();
    load_scenario(&path)
}

#[test]
fn an_effect_of_ones_own_acts_and_is_held_against_what_was_found() {
    let scenario = own_scenario(OWN).unwrap();
    let streams = Streams { seed: 1, trial: 0 };
    let measured = measure_all(&scenario, streams, &Plans::new(&scenario, 1).unwrap(), &mut ()).unwrap();
    let data = [NamedDataset::new("fit", &measured.fit)];
    // A candidate is not fitted: the diagnosis has to name it.
    let without = identify(&data, &scenario.model).unwrap();
    let truth = ground_truth(&scenario, &streams, &measured.fit, &without).unwrap();
    let belt = &truth.hidden[0];
    assert_eq!((belt.effect.as_str(), belt.met, truth.verdict.name()), ("belt", Met::First, "identified"));
    assert!(belt.visible.unwrap() > 1.0 && truth.named == Some(("belt".into(), false)), "{truth:?}");
    let held = truth.hidden.iter().filter(|h| h.met == Met::InModel).map(|h| h.effect.as_str());
    assert_eq!(held.collect::<Vec<_>>(), ["base_frame", "joint_compliance", "mdh"]);
    // With it in the model its parameters are recovered, within four sigma of the scenario's values.
    let with = identify(&data, &scenario.model.with("belt")).unwrap();
    let truth = ground_truth(&scenario, &streams, &measured.fit, &with).unwrap();
    let belt = truth.hidden.iter().find(|h| h.effect == "belt").unwrap();
    assert_eq!((belt.met, truth.verdict.name()), (Met::InModel, "nothing_left"));
    for (number, size) in belt.numbers.iter().zip([150.0e-6, -100.0e-6]) {
        let [value, sigma] = number.found.unwrap();
        assert!((number.truth - size).abs() < 1e-12, "{}", number.name);
        assert!((value - size).abs() < 4.0 * sigma && sigma < 0.1 * size.abs(), "{}: {value} +- {sigma}", number.name);
    }
}

/// In a population whose robots each have scale errors at six joints, the part of one joint is not a false alarm.
#[test]
fn the_part_of_one_joint_is_part_of_what_is_hidden() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    let scenario = load_scenario(&folder.join("study-robots.toml")).unwrap();
    let streams = Streams { seed: 1, trial: 0 };
    let measured = measure_all(&scenario, streams, &Plans::new(&scenario, 1).unwrap(), &mut ()).unwrap();
    let calibration = identify(&[NamedDataset::new("fit", &measured.fit)], &scenario.model).unwrap();
    let truth = ground_truth(&scenario, &streams, &measured.fit, &calibration).unwrap();
    let first = truth.hidden.iter().find(|h| h.met == Met::First).unwrap();
    assert_eq!((first.effect.as_str(), &truth.named), ("joint_scale", &Some(("joint_scale:1".into(), false))));
    assert!(first.numbers[0].name == "joint_scale:1.s" && first.numbers[0].found.is_some(), "{:?}", first.numbers);
    let other = truth.hidden.iter().find(|h| h.effect == "payload_com").unwrap();
    assert!(other.met != Met::First, "{other:?}");
}

#[test]
fn what_is_wrong_with_an_effect_of_ones_own_is_said_at_its_key() {
    for (from, to, field) in [
        ("sin_urad = 150.0", "sine_urad = 150.0", "truth.effects.belt.sine_urad"),
        ("[truth.effects.belt]", "[truth.effects.blet]", "truth.effects.blet"),
        ("sin(5.5*q3)", "sin(5.5*q9)", "effect[0].terms[0].basis"),
    ] {
        let error = own_scenario(&OWN.replace(from, to)).err().unwrap();
        assert_eq!(error.field, field, "{error}");
        assert!(error.line.is_some(), "{error}");
    }
    // `draw` applies to it as to any other effect.
    let drawn = own_scenario(&OWN.replace("sin_urad = 150.0\ncos_urad = -100.0", "draw = 1.0")).unwrap();
    let sizes = |trial| {
        drawn.truth().drawn(&Streams { seed: 1, trial }).iter().find(|e| e.effect.id() == "belt").unwrap().sizes.clone()
    };
    assert!(sizes(0) != sizes(1) && sizes(0).iter().all(|s| *s != 0.0), "{:?}", sizes(0));
}

/// The tracker does not see the artifact, and vice versa.
#[test]
fn a_moved_ball_moves_no_point() {
    let cell = cell();
    let plans = Plans::new(&cell, 1).unwrap();
    let points = |x_mm: f64| {
        let mut truth = cell.truth().keys().clone();
        truth.effects.insert("ball:3".into(), [("x_mm".to_owned(), x_mm)].into());
        let measured = measure_all(&cell.with_truth(truth).unwrap(), Streams { seed: 1, trial: 0 }, &plans, &mut ()).unwrap();
        measured.validation_truth
    };
    // Servo errors are drawn in order, and a moved ball may take one more step to centre.
    assert!((points(0.0)[0] - points(0.15)[0]).norm() < 1e-4);
}
