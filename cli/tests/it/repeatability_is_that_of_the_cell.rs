//! `calibench cell repeatability` finds the properties of the simulated robot: its repeatability and the lost motion of its joints
//! lie in their intervals as often as stated, for a perfect robot only the gauge's noise remains, and bad input is one clear
//! error.

use std::fs;
use std::process::Command;

use crate::program::calibench;
use crate::served::Bench;
use calibench::measure::campaign::repeatability::{RepeatabilitySettings, Station};
use calibench::units::{ARCSEC, UM, URAD};
use calibench_sim::random::{Streams, normal};
use calibench_sim::repeatability::{stations, visit};
use calibench_sim::scenario::{Scenario, load_scenario};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use tempfile::TempDir;

const CELL: &str = include_str!("../../../scenarios/kr6-trical.toml");
/// Position error of each servo after a large motion, one-sigma, arcsec: visible to the encoders.
const SERVO: [f64; 6] = [1.5, 1.5, 2.0, 3.0, 4.0, 4.0];
/// The same of the gears, which the encoders do not see, arcsec.
const GEARS: [f64; 6] = [1.4, 1.4, 1.9, 2.9, 4.1, 4.1];

/// The paper's cell with these lines changed, and these added.
fn cell(changes: &[(&str, &str)], added: &str) -> (TempDir, Scenario) {
    let folder = tempfile::tempdir().unwrap();
    let mut text = CELL.to_owned();
    for (old, new) in changes {
        assert!(text.contains(old), "the cell has no {old:?}");
        text = text.replacen(old, new, 1);
    }
    fs::write(folder.path().join("kr6-trical.toml"), text).unwrap();
    let own = format!(
        "format = \"calibench-scenario/1\"\nextends = \"kr6-trical.toml\"\nname = \"s\"\nquestion = \"?\"\nseed = 1\n{added}"
    );
    let path = folder.path().join("s.toml");
    fs::write(&path, own).unwrap();
    let scenario = load_scenario(&path).unwrap();
    (folder, scenario)
}

/// RP of infinitely many returns from the known scatter: that of every joint, through its lever.
fn endless_rp(station: &Station, arcsec: impl Fn(usize) -> f64) -> f64 {
    /// Number of simulated returns.
    const DRAWS: usize = 200_000;
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..DRAWS {
        let off: Vector3<f64> =
            station.levers.iter().enumerate().map(|(j, lever)| lever * normal(arcsec(j) * ARCSEC, &mut random)).sum();
        sum += off.norm();
        squares += off.norm_squared();
    }
    let mean = sum / DRAWS as f64;
    mean + 3.0 * (squares / DRAWS as f64 - mean * mean).sqrt()
}

/// Guarantee: 95 % of the intervals cover the ground truth. With 200 cells (1,200 intervals for the joints) a correct program
/// fails the bands below once in 2,000. The gauge's own noise, which the expected RP neglects, is 0.2 % of RP.
#[test]
fn intervals_hold_the_truth_as_often_as_stated() {
    /// Number of simulated visits to the cell.
    const TRIALS: u64 = 200;
    let h = [0.0, 30.0, -45.0, 0.0, 20.0, 60.0];
    let effect = |j: usize| format!("[truth.effects.\"hysteresis:{}\"]\nh_urad = {:.1}\n", j + 1, h[j]);
    let (_folder, scenario) = cell(&[], &[1, 2, 4, 5].map(effect).concat());
    let settings = RepeatabilitySettings { reversals: 6, ..RepeatabilitySettings::default() };
    let places = stations(&scenario, &[2], 1, 1).unwrap();
    let attained = endless_rp(&places[0], |j| SERVO[j].hypot(GEARS[j]));
    let unseen = endless_rp(&places[0], |j| GEARS[j]);
    println!("RP {:.1} um, of which unseen {:.1} um", attained / UM, unseen / UM);
    let (mut rp_held, mut unseen_held, mut lost_held) = (0, 0, 0);
    let (mut sums, mut squares) = ([0.0; 6], [0.0; 6]);
    for trial in 0..TRIALS {
        let found = visit(&scenario, Streams { seed: 4, trial }, &places, &settings).unwrap().repeatability;
        let within = |[low, high]: [f64; 2], truth: f64| usize::from(low <= truth && truth <= high);
        rp_held += within(found.stations[0].attained.interval, attained);
        unseen_held += within(found.stations[0].unseen.interval, unseen);
        for j in &found.lost_motion {
            lost_held += within(j.interval, 2.0 * h[j.joint] * URAD);
            sums[j.joint] += j.reversal / URAD;
            squares[j.joint] += (j.reversal / URAD).powi(2);
        }
    }
    println!("of {TRIALS}: RP {rp_held}, unseen {unseen_held}; of {}: lost motion {lost_held}", 6 * TRIALS);
    assert!((179..=199).contains(&rp_held) && (179..=199).contains(&unseen_held));
    assert!((1110..=1170).contains(&lost_held));
    for j in 0..6 {
        let mean: f64 = sums[j] / TRIALS as f64;
        let error = ((squares[j] / TRIALS as f64 - mean * mean) / TRIALS as f64).sqrt();
        println!("joint {}: {mean:.2} +- {error:.2} urad for {}", j + 1, 2.0 * h[j]);
        // Four standard errors, and 3 % for levers of the nominal arm and for the plungers, whose own hysteresis appears as
        // lost motion.
        assert!((mean - 2.0 * h[j]).abs() < 4.0 * error + 0.06 * h[j].abs(), "joint {}", j + 1);
    }
}

/// Guarantee: for a robot without scatter and lost motion only the gauge's own noise remains, and lost motion of a joint is
/// shown only by chance.
#[test]
fn of_a_perfect_robot_the_gauge_is_left() {
    let zeros = "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]";
    let (servo, gears, play) = (
        format!("servo_error_arcsec = {zeros} #"),
        format!("lost_motion_arcsec = {zeros} #"),
        format!("play_arcsec = {zeros} #"),
    );
    let changes = [
        ("encoder_resolution_deg = 1e-5", "encoder_resolution_deg = 0.0"),
        ("servo_error_arcsec = ", servo.as_str()),
        ("lost_motion_arcsec = ", gears.as_str()),
        ("play_arcsec = ", play.as_str()),
        // Ball form and plunger hysteresis during motion also belong to the gauge, but do not appear in readings at rest.
        ("ball_form_um = 0.13", "ball_form_um = 0.0"),
        ("\nhysteresis_um = 0.3", "\nhysteresis_um = 0.0"),
    ];
    let (_folder, scenario) = cell(&changes, "");
    let settings =
        RepeatabilitySettings { returns: 100, readings_at_rest: 100, reversals: 20, ..RepeatabilitySettings::default() };
    let places = stations(&scenario, &[0, 1, 2, 3], 1, 1).unwrap();
    let found = visit(&scenario, Streams { seed: 1, trial: 0 }, &places, &settings).unwrap().repeatability;
    for s in &found.stations {
        let [attained, gauge] = [s.attained.rp, s.gauge.rp].map(|v| v / UM);
        println!("{}: attained {attained:.3} um, gauge {gauge:.3} um", s.id);
        // 0.1 um of noise along each axis is an RP of 0.36 um; two RPs from a hundred values each differ by 14 %, one sigma.
        assert!((attained / gauge - 1.0).abs() < 0.5 && attained < 0.6, "{}", s.id);
    }
    for j in &found.lost_motion {
        // A tenth of a micrometre at the end of the joint's lever, from 160 arrivals.
        assert!(j.at_tcp() < 0.1 * UM, "joint {}: {} um", j.joint + 1, j.at_tcp() / UM);
    }
}

#[test]
fn the_program_prints_one_document_and_the_same_bytes_again() {
    let (folder, _) = cell(&[], "");
    let arguments =
        ["cell", "repeatability", "s.toml", "--ball", "3", "--ball", "1", "--returns", "5", "--reversals", "2", "--json"];
    let first = calibench(folder.path(), &arguments);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let document: Value = serde_json::from_slice(&first.stdout).unwrap();
    assert_eq!(document["format"], "calibench-repeatability/1");
    let balls: Vec<&Value> = document["stations"].as_array().unwrap().iter().map(|s| &s["ball"]).collect();
    assert_eq!(balls, ["1", "3"]);
    assert_eq!(document["lost_motion"].as_array().unwrap().len(), 6);
    assert_eq!(first.stdout, calibench(folder.path(), &arguments).stdout);
    let other = calibench(folder.path(), &[&arguments[..], &["--seed", "2"]].concat());
    assert!(other.status.success() && other.stdout != first.stdout);
    let table = calibench(folder.path(), &arguments[..arguments.len() - 1]);
    let text = String::from_utf8(table.stdout).unwrap();
    assert!(text.contains("ISO 9283") && text.contains("reversal, µrad"), "{text}");
}

/// Guarantee: a served cell gives the same result. An RP of 30 returns is within a factor of 1.5 of that for infinitely many,
/// with more than six standard deviations to spare.
#[cfg(unix)]
#[test]
fn a_cell_on_its_wires_repeats_as_its_robot_does() {
    let bench = Bench::small();
    let served = bench.serve(&[]);
    bench.write_cell(&served, "", "", "[guards]\njoint_margin_deg = 0.0");
    let arguments = ["--yes", "--ball", "1", "--ball", "3", "--reversals", "3", "--json"];
    let output = Command::new(env!("CARGO_BIN_EXE_calibench"))
        .args(["cell", "repeatability", "--cell"])
        .arg(bench.path("cell.toml"))
        .arg("--plan")
        .arg(bench.path("plan.toml"))
        .args(arguments)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    let cell = bench.cell();
    let found = document["stations"].as_array().unwrap();
    let balls: Vec<&Value> = found.iter().map(|s| &s["ball"]).collect();
    assert!(balls.contains(&&Value::from("1")) && balls.contains(&&Value::from("3")) && balls.len() == 2, "{balls:?}");
    for station in found {
        let pose = bench.poses.iter().find(|p| station["id"] == p.id.as_str()).unwrap();
        let station_of = Station::new(&cell.robot, &cell.base, &cell.tool, pose.clone());
        let both = endless_rp(&station_of, |j| SERVO[j].hypot(GEARS[j])) / UM;
        let rp = station["attained"]["rp_um"].as_f64().unwrap();
        println!("{}: {rp:.1} um for {both:.1}", pose.id);
        assert!((both / 1.5..both * 1.5).contains(&rp), "{}: {rp} um for {both}", pose.id);
    }
    let refused = Command::new(env!("CARGO_BIN_EXE_calibench"))
        .args(["cell", "repeatability", "scenarios/none.toml", "--cell", "cell.toml", "--plan", "plan.toml"])
        .output()
        .unwrap();
    assert_eq!(refused.status.code(), Some(2), "a scenario or a cell, not both");
}

#[test]
fn bad_input_is_one_clear_error() {
    let (good, _) = cell(&[], "");
    let (unreachable, _) = cell(&[("x_mm = -79.539", "x_mm = 5000.0")], "");
    let cases: [(&TempDir, &[&str], [&str; 2]); 6] = [
        (&good, &["--ball", "9"], ["`9`", "give one of 1, 2, 3, 4"]),
        (&good, &["--returns", "1"], ["--returns", "from 2 to"]),
        (&good, &["--reversals", "1"], ["--reversals", "from 2 to"]),
        (&good, &["--returns", "-3"], ["--returns", "from 2 to"]),
        (&good, &["--postures", "0"], ["--postures", "from 1 to"]),
        (&unreachable, &["--ball", "1"], ["kr6-trical.toml", "move the ball"]),
    ];
    for (folder, flags, told) in cases {
        let output = calibench(folder.path(), &[&["cell", "repeatability", "s.toml"], flags].concat());
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{flags:?}: {error}");
        assert!(output.stdout.is_empty() && error.matches('\n').count() == 1, "{flags:?}: {error}");
        assert!(told.iter().all(|t| error.contains(t)), "{flags:?}: {error}");
    }
}
