//! The commands that calibrate a real robot from public data, and their standard output as read by other programs.
//!
//! The files are in `tests/data`.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::oracles::data;

/// A folder for one test.
fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Runs the program; exit code, standard output, standard error.
fn calibench(arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_calibench")).args(arguments.iter().map(|a| a.as_ref())).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn done(arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> String {
    let (code, out, err) = calibench(arguments);
    assert_eq!(code, Some(0), "{err}");
    out
}

#[test]
fn a_map_is_proposed_and_a_wrong_robot_is_named() {
    let folder = scratch("guessed");
    let (table, map, dataset) = (data("fanuc-r2000ic").join("measurements.csv"), folder.join("map.toml"), folder.join("d"));
    let (code, out, _) = calibench(&[&"import", &"guess", &table, &"--robot", &"ur5", &"-o", &map]);
    assert!(code == Some(1) && out.contains("These data do not fit this robot"), "{out}");
    let grid = data("ur5-jacobi").join("3D_UR5_uncalibrated_grid_cleaned.csv");
    let out = done(&[&"import", &"guess", &grid, &"--robot", &"ur5", &"-o", &map]);
    assert!(out.contains("Check them, and the map in") && out.contains("joint_1"), "{out}");
    let document = json(&[&"import", &"guess", &grid, &"--robot", &"ur5", &"-o", &map, &"--json"]);
    assert_eq!(document["misfit"], Value::Null);
    let imported = json(&[&"import", &"generic", &grid, &"--map", &map, &"-o", &dataset, &"--json"]);
    assert!((number(&imported["nominal_fit"], "residual_mm") - 0.68).abs() < 0.01, "{imported}");
    for (arguments, said) in [
        (vec!["import", "guess", "a.csv", "b.csv", "--robot", "ur5", "-o", "m.toml"], "one file at a time"),
        (vec!["import", "guess", "a.csv", "-o", "m.toml"], "needs the robot"),
        (vec!["import", "guess", "absent.csv", "--robot", "ur5", "-o", "m.toml"], "absent.csv"),
    ] {
        let (code, _, err) = calibench(&arguments.iter().map(|a| a as &dyn AsRef<std::ffi::OsStr>).collect::<Vec<_>>());
        assert!(code == Some(2) && err.contains(said), "{err}");
    }
}

#[test]
fn rows_measured_again_take_the_set_up_of_the_campaign() {
    let folder = scratch("again");
    let grid = std::fs::read_to_string(data("ur5-jacobi").join("3D_UR5_uncalibrated_grid_cleaned.csv")).unwrap();
    let lines: Vec<&str> = grid.lines().collect();
    // Some rows of the campaign again, 60 um off by turns, as by an instrument of 50 um.
    let again = lines[1..].iter().step_by(90).enumerate().map(|(k, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        let axis = 4 + k % 3;
        cells[axis] = (cells[axis].parse::<f64>().unwrap() + if k % 2 == 0 { 0.06 } else { -0.06 }).to_string();
        cells.join(",")
    });
    let later: Vec<String> = std::iter::once(lines[0].to_owned()).chain(again).collect();
    let (table, map) = (folder.join("later.csv"), folder.join("map.toml"));
    std::fs::write(folder.join("grid.csv"), &grid).unwrap();
    std::fs::write(&table, later.join("\n")).unwrap();
    done(&[&"import", &"guess", &folder.join("grid.csv"), &"--robot", &"ur5", &"-o", &map]);
    let noise = "\n[dataset.noise]\npoint_um = 50\n";
    std::fs::write(&map, std::fs::read_to_string(&map).unwrap() + noise).unwrap();
    let (then, calibration) = (folder.join("then"), folder.join("c.toml"));
    done(&[&"import", &"generic", &folder.join("grid.csv"), &"--map", &map, &"-o", &then]);
    done(&[&"identify", &then, &"-o", &calibration]);
    // A base and a tool found from these rows are not those of the campaign.
    let (own, same) = (folder.join("own"), folder.join("same"));
    done(&[&"import", &"generic", &table, &"--map", &map, &"-o", &own]);
    let (code, _, err) = calibench(&[&"keep", &"check", &calibration, &own, &"--then", &then]);
    assert!(code == Some(2) && err.contains("import --set-up-of"), "{err}");
    done(&[&"import", &"generic", &table, &"--map", &map, &"--set-up-of", &then, &"-o", &same]);
    assert_eq!(json(&[&"keep", &"check", &calibration, &same, &"--then", &then, &"--json"])["verdict"], "valid");
    // A base that is stated is not silently replaced.
    let placed = folder.join("placed.toml");
    let base = "\n[dataset.base]\nx_mm = 0\ny_mm = 0\nz_mm = 10\n";
    std::fs::write(&placed, std::fs::read_to_string(&map).unwrap() + base).unwrap();
    let (code, _, err) = calibench(&[&"import", &"generic", &table, &"--map", &placed, &"--set-up-of", &then, &"-o", &same]);
    assert!(code == Some(2) && err.contains("another base than is stated"), "{err}");
    // The set-up of another robot is none.
    let (ur10, other) = (data("ur10-ipa").join("Series_D").join("measurements_iso_cubes.csv"), folder.join("ur10"));
    done(&[&"import", &"ur10-ipa", &ur10, &"-o", &other]);
    let (code, _, err) = calibench(&[&"import", &"generic", &table, &"--map", &map, &"--set-up-of", &other, &"-o", &same]);
    assert!(code == Some(2) && err.contains("is of the robot ur10, the rows are of ur5"), "{err}");
}

/// The rows of a table that was calibrated whole, and divided afterwards.
#[test]
fn rows_that_were_fitted_are_known_under_another_name() {
    let folder = scratch("renamed");
    let table = data("ur10-ipa").join("Series_D").join("measurements_iso_cubes.csv");
    let [whole, part, of_whole, of_part] = ["whole", "part", "whole.toml", "part.toml"].map(|name| folder.join(name));
    done(&[&"import", &"ur10-ipa", &table, &"-o", &whole]);
    done(&[&"import", &"ur10-ipa", &table, &"--holdout", &"0.3", &"-o", &part]);
    done(&[&"identify", &whole, &"-o", &of_whole]);
    done(&[&"identify", &part, &"-o", &of_part]);
    let (code, out, err) = calibench(&[&"validate", &of_whole, &part]);
    assert_eq!(code, Some(1), "nothing is held out");
    assert!(
        err.contains("about 100 % of these rows are the same as rows that were fitted")
            && out.contains("residual of the fit, 196 samples"),
        "{out}{err}"
    );
    let (_, out, err) = calibench(&[&"validate", &of_part, &part]);
    assert!(!err.contains("rows that were fitted") && out.contains("measured, held out, 196 samples"), "{out}{err}");
    let fitted =
        |calibration: &PathBuf, of: &PathBuf| number(&json(&[&"validate", calibration, of, &"--fitted", &"--json"]), "fitted");
    assert_eq!((fitted(&of_whole, &part), fitted(&of_part, &part)), (1.0, 0.0));
    assert!((fitted(&of_part, &whole) - 0.7).abs() < 0.1);
    let fitted = |calibration: &PathBuf| json(&[&"compare", calibration, &part, &"--validation", &"--json"])["fitted"].clone();
    assert_eq!((fitted(&of_whole), fitted(&of_part)), (Value::from(true), Value::from(false)));
    // Nor are they a check of a model that is fitted to them.
    let (code, _, err) = calibench(&[&"ladder", &part, &"--check", &whole]);
    assert!(code == Some(2) && err.contains("most of them are also fitted, and cannot serve as a check"), "{err}");
}

/// One JSON document and nothing else.
fn json(arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> Value {
    let out = done(arguments);
    serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out}"))
}

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number: {v}"))
}

/// Checks the keys that `identify --json` promises.
fn assert_calibration(v: &Value) {
    assert_eq!(v["format"], "calibench-calibration/2");
    for p in v["parameters"].as_array().unwrap() {
        assert!(p["name"].is_string() && p["unit"].is_string(), "{p}");
        for key in ["value", "sigma", "nominal"] {
            assert!(number(p, key).is_finite());
        }
        assert!(number(p, "sigma") > 0.0, "{p}");
    }
    for key in ["residual_mm", "chi2_per_dof", "condition"] {
        assert!(number(v, key).is_finite());
    }
    let determined = v["parameters"].as_array().unwrap().len() as u64;
    assert_eq!(v["rank"].as_u64().unwrap(), determined);
    let directions = if v["residual_orientation_deg"].is_null() { 3 } else { 6 };
    assert!(
        v["dof"].as_u64().unwrap() <= directions * v["samples"].as_u64().unwrap() - determined + 12,
        "twelve known distances at most"
    );
    assert!(number(&v["observability"], "O1") > 0.0 && number(&v["observability"], "O5") > 0.0);
    assert!(v["unresolved"].as_array().unwrap().iter().all(|g| g.as_array().is_some_and(|g| g.iter().all(Value::is_string))));
}

/// Checks the keys that `validate --json` promises.
fn assert_validation(v: &Value, samples: u64) {
    assert_eq!(v["format"], "calibench-validation/1");
    assert_eq!(v["samples"], samples);
    let [mean, max, std, rms] = ["mean_mm", "max_mm", "std_mm", "rms_mm"].map(|key| number(v, key));
    assert!(0.0 < mean && mean <= rms && rms <= max && std < max, "{v}");
    let n = samples as f64;
    assert!((rms * rms - mean * mean - std * std * (n - 1.0) / n).abs() < 1e-9, "rms, mean and std are of the same numbers");
}

#[test]
fn ur10_with_a_share_held_out() {
    let root = data("ur10-ipa");
    let scratch = scratch("ur10");
    let (dataset, calibration, geometry) = (scratch.join("D"), scratch.join("cal.toml"), scratch.join("model.toml"));
    let a = root.join("Series_A/measurements_grid.csv");
    let b = root.join("Series_B/measurements_joint_configurations.csv");
    let said = done(&[&"import", &"ur10-ipa", &a, &b, &"-o", &dataset, &"--holdout", &"0.3", &"--seed", &"1"]);
    assert!(said.contains("13406 samples, 4029 of them for validation"), "{said}");
    let v = json(&[&"identify", &dataset, &"-o", &calibration, &"--json"]);
    assert_calibration(&v);
    let names: Vec<&str> = v["parameters"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    for name in ["base_x@Series_A", "base_x@Series_B", "tool_z@Series_A", "tool_z@Series_B", "a2", "c2"] {
        assert!(names.contains(&name), "{name}: {names:?}");
    }
    let v = json(&[&"validate", &calibration, &dataset, &"--json"]);
    assert_validation(&v, 4_029);
    assert!(number(&v, "rms_mm") < 0.438, "{v}");
    std::fs::write(&geometry, "effects = [\"base_frame\", \"mdh\"]\n").unwrap();
    assert_calibration(&json(&[&"identify", &dataset, &"--model", &geometry, &"-o", &calibration, &"--json"]));
    let v = json(&[&"validate", &calibration, &dataset, &"--json"]);
    assert!((0.438..0.461).contains(&number(&v, "rms_mm")), "geometry alone is worse: {v}");
}

/// Of these rows one block alone determines a combination of parameters.
#[test]
fn ur10_cubes_are_predicted_as_well_as_they_are_fitted() {
    let (cubes, dataset) = (data("ur10-ipa").join("Series_D/measurements_iso_cubes.csv"), scratch("ur10").join("cubes"));
    done(&[&"import", &"ur10-ipa", &cubes, &"-o", &dataset, &"--holdout", &"0.3", &"--seed", &"1"]);
    let (_, step, _) = calibench(&[&"add", &"harmonic1:2", &dataset, &"--json"]);
    let step: Value = serde_json::from_str(&step).unwrap();
    for model in ["before", "after"] {
        let [fit, predicted] = ["residual_mm", "cross_validated_mm"].map(|key| number(&step[model], key));
        assert!(fit < predicted && predicted < 1.25 * fit, "{model}: {fit}, {predicted}");
    }
}

#[test]
fn ur10_robot_of_one_campaign_judged_in_the_other() {
    let root = data("ur10-ipa");
    let scratch = scratch("ur10-campaigns");
    let (grid, other, calibration) = (scratch.join("A"), scratch.join("B"), scratch.join("cal.toml"));
    let [a, b] = ["Series_A/measurements_grid.csv", "Series_B/measurements_joint_configurations.csv"].map(|f| root.join(f));
    done(&[&"import", &"ur10-ipa", &a, &"-o", &grid]);
    // Fifty rows are kept for fitting the robot's new set-up.
    done(&[&"import", &"ur10-ipa", &b, &"-o", &other, &"--holdout", &"0.9666"]);
    done(&[&"identify", &grid, &"-o", &calibration]);
    let v = json(&[&"validate", &calibration, &other, &"--json"]);
    assert_validation(&v, 1_448);
    assert_eq!((v["from_fit_rows"].as_array().unwrap().len(), v["refitted"].as_array().unwrap().len()), (12, 0), "{v}");
    assert!(number(&v["orientation"], "rms_deg") < 0.055, "{v}");
    // The independent analysis found 0.483 mm.
    assert!(number(&v, "rms_mm") < 0.483, "{v}");
    let asked = json(&[&"validate", &calibration, &other, &"--set-up-anew", &"--json"]);
    assert_eq!(asked, v, "sessions that have names know by themselves that they are others");
    let (code, _, err) = calibench(&[&"identify", &grid, &scratch.join("B/../A")]);
    assert_eq!(code, Some(0));
    assert!(err.contains("counted once"), "{err}");
}

#[test]
fn ur5_random_poses_validate() {
    let root = data("ur5-jacobi");
    let scratch = scratch("ur5");
    let (dataset, calibration) = (scratch.join("D"), scratch.join("cal.toml"));
    let grid = root.join("3D_UR5_uncalibrated_grid_cleaned.csv");
    let random = root.join("3D_UR5_uncalibrated_random_cleaned.csv");
    done(&[&"import", &"ur5-jacobi", &grid, &random, &"-o", &dataset]);
    let v = json(&[&"identify", &dataset, &"-o", &calibration, &"--json"]);
    assert_calibration(&v);
    assert_eq!(v["samples"], 1_000);
    let v = json(&[&"validate", &calibration, &dataset, &"--json"]);
    assert_validation(&v, 20);
    assert!(number(&v, "mean_mm") < 0.105, "{v}");
    // The same with explicit options.
    let again = scratch.join("again");
    let said = done(&[&"import", &"ur5-jacobi", &random, &grid, &"--validation", &random, &"-o", &again]);
    assert!(said.contains("1020 samples, 20 of them for validation"), "{said}");
    let (code, _, err) = calibench(&[&"import", &"ur5-jacobi", &random, &"--validation", &random, &"-o", &again]);
    assert_eq!(code, Some(2));
    assert!(err.contains("leave at least one to be fitted"), "{err}");
}

#[test]
fn panda_with_a_place_kept_for_validation() {
    let scratch = scratch("panda");
    let (dataset, calibration) = (scratch.join("D"), scratch.join("cal.toml"));
    let panda = data("mukca").join("panda_3");
    let said = done(&[&"import", &"mukca", &panda, &"--validation", &panda.join("backleft"), &"-o", &dataset]);
    assert!(said.contains("387 samples, 63 of them for validation"), "{said}");
    let v = json(&[&"identify", &dataset, &"-o", &calibration, &"--json"]);
    assert_calibration(&v);
    let names: Vec<&str> = v["parameters"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"ball:frontleft/hole_0.x") && names.contains(&"tool_z") && names.contains(&"c2"), "{names:?}");
    assert!(!names.iter().any(|n| n.starts_with("base_") || n.contains("backleft")), "{names:?}");
    let v = json(&[&"validate", &calibration, &dataset, &"--json"]);
    assert_validation(&v, 63);
    let refitted = v["refitted"].as_array().unwrap();
    assert_eq!(refitted.len(), 6, "two holes of the place: {refitted:?}");
    assert!(number(&v, "rms_mm") < 0.25, "{v}");
    // Balls placed by the compared rows cannot be named as in error.
    for rows in ["--validation", "--all"] {
        let v = json(&[&"compare", &calibration, &dataset, &rows, &"--json"]);
        let mut accused = v["findings"].as_array().unwrap().iter().filter(|f| f["view"] == "ball");
        assert!(!accused.any(|f| f.to_string().contains("backleft")), "{v}");
    }
}
