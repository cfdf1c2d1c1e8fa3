//! The rival instruments of the TriCal measure as specified in their scenario: without errors no residuals remain, with noise
//! the residuals are that noise, the pushing force of a seat bends the arm, and verbs that support the TriCal alone say so.

use std::fs;
use std::process::Command;

use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset};
use calibench::residuals::Validation;
use calibench::robot::kinematics::world_from_tool;
use calibench::units::{MM, UM};
use calibench_sim::planning::shown;
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::measure_all;
use calibench_sim::scenario::{Scenario, load_scenario};
use tempfile::TempDir;

const CELL: &str = include_str!("../../../scenarios/kr6-trical.toml");
const ANCHORS: &str = "anchors_mm = [[-79.5, -330.1, 17.5], [-79.2, 287.8, 18.7], [-79.6, -22.0, 276.4]]";

/// A robot that reaches its commanded poses, a noise-free judge, and the instrument; `added` lists the errors of the robot.
fn cell(instrument: &str, added: &str) -> (TempDir, Scenario) {
    let folder = tempfile::tempdir().unwrap();
    let zeros = "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0] #";
    let mut text = CELL.to_owned();
    for (key, value) in [
        ("encoder_resolution_deg = ", "0.0 #"),
        ("servo_error_arcsec = ", zeros),
        ("lost_motion_arcsec = ", zeros),
        ("small_move_play_arcsec = ", zeros),
        ("ball_sigma_um = ", "0.0 #"),
        ("[truth.tool]\nsigma_um = ", "0.0 #"),
        ("[truth.tracker]\nsigma_um = ", "0.0 #"),
        ("pool_per_ball = ", "200 #"),
        ("starts = ", "1 #"),
        ("validation_poses = ", "50 #"),
        ("identification_poses = ", "40 #"),
    ] {
        assert!(text.contains(key), "{key}");
        text = text.replacen(key, &format!("{key}{value}"), 1);
    }
    fs::write(folder.path().join("cell.toml"), text).unwrap();
    let own = format!(
        "format = \"calibench-scenario/1\"\nextends = \"cell.toml\"\nname = \"s\"\nquestion = \"?\"\nseed = 1\n[instrument]\n{instrument}\n{added}"
    );
    let path = folder.path().join("s.toml");
    fs::write(&path, own).unwrap();
    let scenario = load_scenario(&path).unwrap();
    (folder, scenario)
}

fn measured(scenario: &Scenario) -> (Dataset, Dataset) {
    let plans = Plans::new(scenario, scenario.seed).unwrap();
    let m = measure_all(scenario, Streams { seed: scenario.seed, trial: 0 }, &plans, &mut ()).unwrap();
    (m.fit, m.validation)
}

/// Mean error over the workspace after a calibration with the instrument's measurements, m.
fn error(scenario: &Scenario) -> f64 {
    let (fit, validation) = measured(scenario);
    let model: Model = shown(&scenario.model, &fit);
    let calibration = identify(&[NamedDataset::new("fit", &fit)], &model).unwrap();
    let prediction = calibration.predict(&[NamedDataset::new("validation", &validation)], Use::Validation).unwrap();
    Validation::of(&prediction).unwrap().mean
}

/// Measured distances minus those of the nominal robot, m: the robot of these tests is the nominal one.
fn distance_residuals(scenario: &Scenario) -> Vec<f64> {
    let (fit, _) = measured(scenario);
    let off = |s: &calibench::measure::dataset::Sample| match s.measured {
        Measured::Distance { anchor, distance } => {
            let tcp = world_from_tool(&fit.robot, &fit.base, &fit.tool, &s.q).translation.vector;
            Some(distance - (tcp - fit.anchors[anchor].position).norm())
        }
        _ => None,
    };
    fit.samples.iter().filter_map(off).collect()
}

const ERRORS: &str = "[truth.effects.mdh]\na1_mm = 0.3\nalpha4_deg = 0.05\ntheta3_deg = 0.05\nd4_mm = -0.3\n\
                      [truth.effects.base_frame]\nbase_x_mm = -1.7\nbase_rz_deg = 0.2\n";

/// Guarantee: an instrument with almost no errors of its own finds the robot's, and leaves almost none over the workspace.
#[test]
fn without_errors_they_leave_none() {
    let bar = format!("kind = \"ballbar\"\nposes = 150\nlength_mm = 300.0\nrange_mm = 1.0\nnoise_um = 0.01\n{ANCHORS}");
    let wires = format!("kind = \"wire_sensor\"\nposes = 80\nnoise_um = 0.01\n{ANCHORS}");
    for (name, instrument, most) in [
        ("ballbar", bar.as_str(), 5.0),
        ("wires", wires.as_str(), 5.0),
        // A seat is closed to 0.3 um.
        ("seat", "kind = \"seat\"\nnoise_um = 0.0", 5.0),
    ] {
        let (_folder, scenario) = cell(instrument, ERRORS);
        let left = error(&scenario) / UM;
        println!("{name}: {left:.3} um left");
        assert!(left < most, "{name}: {left} um");
    }
}

/// Guarantee: residuals scatter as the scenario specifies. A standard deviation of n residuals is known to 1 / sqrt(2 n); at
/// four of those a correct program fails once in 16,000.
#[test]
fn distances_are_as_noisy_as_specified() {
    let bar = format!("kind = \"ballbar\"\nposes = 150\nnoise_um = 20.0\n{ANCHORS}");
    let wires =
        format!("kind = \"wire_sensor\"\nposes = 80\nnoise_um = 40.0\nlinearity_um = 100.0\nperiod_mm = 37.0\n{ANCHORS}");
    for (name, instrument, rows, specified) in
        [("ballbar", bar, 150, 20.0), ("wires", wires, 240, f64::hypot(40.0, 100.0 / 2f64.sqrt()))]
    {
        let (_folder, scenario) = cell(&instrument, "");
        let off = distance_residuals(&scenario);
        assert_eq!(off.len(), rows, "{name}");
        let sigma = (off.iter().map(|v| v * v).sum::<f64>() / rows as f64).sqrt() / UM;
        println!("{name}: {sigma:.1} um for {specified:.1}");
        assert!((sigma / specified - 1.0).abs() < 4.0 / (2.0 * rows as f64).sqrt(), "{name}: {sigma} um for {specified}");
    }
}

/// Guarantee: a bar reads only within its range, wherever an uncalibrated robot would have taken it.
#[test]
fn a_bar_stays_in_its_range() {
    let bar = format!("kind = \"ballbar\"\nposes = 60\nlength_mm = 300.0\nrange_mm = 1.0\nnoise_um = 1.0\n{ANCHORS}");
    let (_folder, scenario) = cell(&bar, ERRORS);
    let (fit, _) = measured(&scenario);
    for s in &fit.samples {
        let Measured::Distance { distance, .. } = s.measured else { panic!("{} is no distance", s.id) };
        assert!((distance / MM - 300.0).abs() < 1.01, "{}: {} mm", s.id, distance / MM);
    }
}

#[test]
fn what_pushes_in_a_seat_bends_the_arm() {
    let compliance = "[truth.effects.joint_compliance]\nc2_mdeg_per_nm = 3.0\nc3_mdeg_per_nm = 3.2\n";
    let error_by =
        |force: f64| error(&cell(&format!("kind = \"seat\"\nnoise_um = 0.0\nforce_n = {force:.1}"), compliance).1) / UM;
    let [free, pushed] = [0.0, 20.0].map(error_by);
    println!("{free:.1} um without a force, {pushed:.1} um with 20 N");
    assert!(free < 5.0 && pushed > 5.0 * free.max(1.0));
}

/// Guarantee: in off-centre readings the errors of the plungers count, which nulling removes.
#[test]
fn off_centre_the_gauge_s_own_errors_count() {
    let crooked = |kind: &str| {
        let (folder, _) = cell(&format!("kind = \"{kind}\"\nrange_mm = 5.0"), ERRORS);
        let path = folder.path().join("cell.toml");
        let text = fs::read_to_string(&path).unwrap().replace("squareness_mrad = 0.3", "squareness_mrad = 10.0");
        fs::write(&path, text).unwrap();
        error(&load_scenario(&folder.path().join("s.toml")).unwrap()) / UM
    };
    let [nulled, offset] = ["trical", "offset"].map(crooked);
    println!("nulled {nulled:.1} um, read off centre {offset:.1} um");
    assert!(offset > 2.0 * nulled);
}

#[test]
fn other_verbs_say_that_they_know_the_trical_alone() {
    let (folder, _) = cell("kind = \"seat\"", "");
    for verb in ["run", "cell repeatability", "sim suite"] {
        let mut program = Command::new(env!("CARGO_BIN_EXE_calibench"));
        let output = program.current_dir(folder.path()).args(verb.split(' ')).arg("s.toml").output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{verb}: {error}");
        assert!(
            error.contains("instrument.kind") && error.contains("s.toml:7") && error.contains("sim study"),
            "{verb}: {error}"
        );
    }
}

#[test]
fn an_instrument_that_cannot_measure_is_refused() {
    for (instrument, key) in [
        ("kind = \"ballbar\"", "instrument.anchors_mm"),
        ("kind = \"sextant\"", "instrument.kind"),
        ("kind = \"seat\"\nforce_n = -1.0", "instrument.force_n"),
        ("kind = \"offset\"\nrange_mm = 0.0", "instrument.range_mm"),
        ("poses = 0", "instrument.poses"),
    ] {
        let folder = cell("", "").0;
        let path = folder.path().join("s.toml");
        let text = fs::read_to_string(&path).unwrap().replace("[instrument]\n", &format!("[instrument]\n{instrument}\n"));
        fs::write(&path, text).unwrap();
        let error = load_scenario(&path).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains(key), "{instrument}: {error}");
    }
}
