//! `keep runs` and `keep fleet` on public data: the campaigns of one UR10, and what is not a run of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use calibench_report::documents::{Calibration, Fleet, Runs};

use crate::oracles::data;

fn calibench(arguments: &[&str], folder: &Path) -> (Option<i32>, Vec<u8>, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_calibench")).args(arguments).current_dir(folder).output().expect("the program runs");
    (output.status.code(), output.stdout, String::from_utf8_lossy(&output.stderr).into_owned())
}

/// The campaigns of the UR10, forty rows of each, as folders A, B and D.
fn campaigns() -> (tempfile::TempDir, PathBuf) {
    let keep = tempfile::tempdir().unwrap();
    let folder = keep.path().to_owned();
    let root = data("ur10-ipa");
    for (name, file) in [
        ("A", "Series_A/measurements_grid.csv"),
        ("B", "Series_B/measurements_joint_configurations.csv"),
        ("D", "Series_D/measurements_iso_cubes.csv"),
    ] {
        let from = root.join(file);
        let (code, _, err) = calibench(&["import", "ur10-ipa", from.to_str().unwrap(), "-o", name], &folder);
        assert_eq!(code, Some(0), "{err}");
        // Every so-manieth row.
        let path = folder.join(name).join("samples.csv");
        let text = fs::read_to_string(&path).unwrap();
        let rows = text.lines().count() - 1;
        let kept = text.lines().enumerate().filter(|(k, _)| *k == 0 || (k - 1) % (rows / 40) == 0).map(|(_, line)| line);
        fs::write(&path, kept.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    }
    (keep, folder)
}

#[test]
fn campaigns_of_a_ur10_are_compared_and_refused() {
    let (_keep, folder) = campaigns();
    let (code, out, err) = calibench(
        &["keep", "runs", "A", "B", "D", "--dates", "2021-03-01,2021-02-01,2021-06-01", "--json", "-o", "now.toml"],
        &folder,
    );
    assert!(code == Some(0) || code == Some(1), "{err}");
    assert!(err.contains("In the order of their dates: B, A, D"), "{err}");
    let document: Runs = serde_json::from_slice(&out).unwrap();
    assert_eq!(document.runs.iter().map(|run| run.run.as_str()).collect::<Vec<_>>(), ["B", "A", "D"]);
    assert!(document.left_out.model_mm.is_some_and(|e| e > 0.1 && e < 2.0), "{:?}", document.left_out);
    assert!(document.parameters.len() > 20);
    assert_eq!(folder.join("now.toml").is_file(), document.verdict != "not_one_geometry");
    for (arguments, said) in [
        (vec!["keep", "runs", "A"], "there is one run only"),
        (vec!["keep", "runs", "A", "A"], "there is one run only"),
        (vec!["keep", "runs", "A", "B", "--dates", "2021-01-01"], "1 dates, and there are 2 runs"),
        (vec!["keep", "runs", "A", "B", "--dates", "2021-13-01,2021-01-01"], "--dates"),
        (vec!["keep", "runs", "A", "B", "--drift", "theta2=0.01"], "date of every run"),
        (vec!["keep", "runs", "A", "B", "--drift", "theta2"], "theta2=0.01"),
        (vec!["keep", "runs", "A", "B", "--drift", "elbow=1", "--dates", "2021-01-01,2021-02-01"], "no parameter 'elbow'"),
    ] {
        let (code, _, err) = calibench(&arguments, &folder);
        assert!(code == Some(2) && err.contains(said) && err.trim().lines().count() <= 3, "{arguments:?}: {err}");
    }
    // The same measurements under another name, with a word more in the description.
    fs::create_dir(folder.join("copy")).unwrap();
    fs::copy(folder.join("A/samples.csv"), folder.join("copy/samples.csv")).unwrap();
    let described = fs::read_to_string(folder.join("A/dataset.toml")).unwrap();
    fs::write(folder.join("copy/dataset.toml"), described.clone() + "\nagain = true\n").unwrap();
    let (code, _, err) = calibench(&["keep", "runs", "A", "copy"], &folder);
    assert!(code == Some(2) && err.contains("copy/samples.csv") && err.contains("are also in A"), "{err}");
    // Of a run of a few rows nothing can be said, and nothing is.
    fs::create_dir(folder.join("few")).unwrap();
    fs::copy(folder.join("B/dataset.toml"), folder.join("few/dataset.toml")).unwrap();
    let rows = fs::read_to_string(folder.join("B/samples.csv")).unwrap();
    fs::write(folder.join("few/samples.csv"), rows.lines().take(4).collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let (code, _, err) = calibench(&["keep", "runs", "A", "few"], &folder);
    assert!(code == Some(2) && err.contains("few/samples.csv") && err.contains("its 3 rows"), "{err}");
    // The verdict is the answer.
    let (told, whole, _) = calibench(&["keep", "runs", "A", "B", "--no-prediction"], &folder);
    let (code, quiet, _) = calibench(&["keep", "runs", "A", "B", "--no-prediction", "-q"], &folder);
    let quiet = String::from_utf8(quiet).unwrap();
    assert!(code == told && quiet.contains("One geometry ") && quiet.len() < whole.len() / 2, "{quiet}");
    // Metres as millimetres.
    let text = fs::read_to_string(folder.join("B/samples.csv")).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let in_metres = |line: &str| {
        let cells = line.split(',').zip(&header).map(|(cell, title)| match cell.parse::<f64>() {
            Ok(number) if ["x_mm", "y_mm", "z_mm"].contains(title) => format!("{}", number / 1000.0),
            _ => cell.to_owned(),
        });
        cells.collect::<Vec<_>>().join(",")
    };
    let slipped: Vec<String> =
        text.lines().enumerate().map(|(k, l)| if k == 0 { l.to_owned() } else { in_metres(l) }).collect();
    fs::write(folder.join("B/samples.csv"), slipped.join("\n") + "\n").unwrap();
    let (code, _, err) = calibench(&["keep", "runs", "A", "B", "D"], &folder);
    assert!(code == Some(2) && err.contains("B/samples.csv"), "{err}");
    fs::write(folder.join("B/samples.csv"), text).unwrap();
    // A date that is none.
    fs::write(folder.join("A/dataset.toml"), described + "\ndate = \"last week\"\n").unwrap();
    let (code, _, err) = calibench(&["keep", "runs", "A", "B"], &folder);
    assert!(code == Some(2) && err.contains("A/dataset.toml") && err.contains("provenance.date"), "{err}");
}

#[test]
fn a_heavier_payload_in_one_run_is_no_other_robot() {
    let keep = tempfile::tempdir().unwrap();
    let folder = keep.path();
    let cell = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/table8.toml");
    let cell = cell.canonicalize().unwrap();
    let heavier = format!(
        "format = \"calibench-scenario/1\"\nextends = \"{}\"\nname = \"heavier\"\n[truth.payload.heavy]\nmass_error_kg = 0.5\n",
        cell.display()
    );
    fs::write(folder.join("heavier.toml"), heavier).unwrap();
    let cell = cell.to_str().unwrap();
    for arguments in [
        vec!["plan", cell, "-o", "plan.toml"],
        vec!["measure", cell, "--plan", "plan.toml", "-o", "then"],
        vec!["measure", "heavier.toml", "--plan", "plan.toml", "--visit", "1", "-o", "now"],
    ] {
        let (code, _, err) = calibench(&arguments, folder);
        assert_eq!(code, Some(0), "{arguments:?}: {err}");
    }
    let (code, out, err) = calibench(&["keep", "runs", "then", "now", "--no-prediction"], folder);
    let said = String::from_utf8(out).unwrap();
    assert_eq!(code, Some(0), "{said}{err}");
    assert!(said.contains("The payload of now differs from what was entered by +0."), "{said}");
    // An arm that is warmer, and that the model does not know to be, is not called another robot without a word.
    let warmer = format!(
        "format = \"calibench-scenario/1\"\nextends = \"{cell}\"\nname = \"warmer\"\n[truth.controller]\nwarm_up_s = 10.0\nwarm_up_c = 8.0\n[truth.effects.\"thermal_growth:temp\"]\nk_um_per_m_k = 23.0\n"
    );
    fs::write(folder.join("warmer.toml"), warmer).unwrap();
    let (code, _, err) = calibench(&["measure", "warmer.toml", "--plan", "plan.toml", "--visit", "1", "-o", "warm"], folder);
    assert_eq!(code, Some(0), "{err}");
    let (_, out, _) = calibench(&["keep", "runs", "then", "warm", "--no-prediction", "-q"], folder);
    let out = String::from_utf8(out).unwrap();
    assert!(out.contains("temperatures of these runs differ by ") && !out.contains("another robot"), "{out}");
    let (_, out, _) = calibench(&["keep", "runs", "then", "now", "--no-prediction", "--json"], folder);
    let document: Runs = serde_json::from_slice(&out).unwrap();
    assert!(document.verdict == "one_geometry_with_changes" && document.differences.len() == 1, "{said}");
    let mass = &document.differences[0].parameters[0];
    assert!((mass.value - 0.5).abs() < 4.0 * mass.sigma && mass.sigma < 0.03, "{mass:?}");
    assert!(document.parameters.iter().all(|p| p.status == "stayed"), "{said}");
}

#[test]
fn a_fleet_is_made_and_used() {
    let (_keep, folder) = campaigns();
    for name in ["A", "B", "D"] {
        let (code, _, err) = calibench(&["identify", name, "-o", &format!("{name}.toml")], &folder);
        assert_eq!(code, Some(0), "{err}");
    }
    let (code, out, err) = calibench(&["keep", "fleet", "A.toml", "B.toml", "-o", "ur10.fleet.toml", "--json"], &folder);
    assert_eq!(code, Some(0), "{err}");
    let fleet: Fleet = serde_json::from_slice(&out).unwrap();
    assert!(fleet.robots == 2 && fleet.parameters.len() > 20, "{fleet:?}");
    let (code, out, err) = calibench(&["identify", "D", "--fleet", "ur10.fleet.toml", "--json"], &folder);
    assert_eq!(code, Some(0), "{err}");
    let calibration: Calibration = serde_json::from_slice(&out).unwrap();
    // It is the same robot.
    assert_eq!(calibration.fleet.map(|f| f.used).as_deref(), Some("fleet"));
    let (code, _, err) = calibench(&["diagnose", "D", "--fleet", "ur10.fleet.toml"], &folder);
    assert_eq!(code, Some(0), "{err}");
    // A robot that was identified with the fleet repeats what the fleet said: it does not count as another.
    let (code, _, err) = calibench(&["identify", "D", "--fleet", "ur10.fleet.toml", "-o", "D.toml"], &folder);
    assert_eq!(code, Some(0), "{err}");
    for (arguments, said) in [
        (
            vec!["keep", "fleet", "A.toml", "B.toml", "D.toml", "-o", "again.toml"],
            "D.toml was identified with the prior of a fleet of 2 robots",
        ),
        (vec!["keep", "fleet", "A.toml"], "there is one robot"),
        (vec!["keep", "fleet", "A.toml", "A.toml"], "the same measurements"),
        (vec!["keep", "fleet", "A.toml", "absent.toml"], "absent.toml"),
        (vec!["identify", "D", "--fleet", "A.toml"], "A.toml"),
    ] {
        let (code, _, err) = calibench(&arguments, &folder);
        assert!(code == Some(2) && err.contains(said), "{arguments:?}: {err}");
    }
}
