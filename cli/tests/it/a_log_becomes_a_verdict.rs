//! A recording becomes a calibration: whatever writer, storage and packing, the rests are those at which the arm stood, and what was
//! measured there is the truth but for the noise. The recordings were made by programs that share no code with this one.

use std::collections::HashMap;
use std::fs;
use std::path::PathBuf;

use serde_json::Value;

use crate::oracles;
use crate::program::{calibench, done, json};

fn recordings() -> PathBuf {
    oracles::folder().join("logs")
}

/// Rows of a table by their titles.
fn rows(path: &std::path::Path) -> Vec<HashMap<String, f64>> {
    let mut table = csv::Reader::from_path(path).unwrap();
    let titles = table.headers().unwrap().clone();
    let number = |(title, text): (&str, &str)| (title.to_owned(), text.parse().unwrap_or(f64::NAN));
    table.records().map(|row| titles.iter().zip(&row.unwrap()).map(number).collect()).collect()
}

#[test]
fn every_rest_of_every_recording_is_what_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let truth = rows(&recordings().join("truth.csv"));
    // By SQLite packed as a file, by MCAP packed by Zstandard, by MCAP packed by LZ4.
    for (name, measured) in [("tracker", "/tracker"), ("frames", "/tf camera>tag_4"), ("board.mcap", "/board")] {
        let recording = recordings().join(name);
        let said = json(at, &["import", "log", recording.to_str().unwrap(), "--robot", "ur5", "-o", name, "--json"]);
        assert_eq!(said["format"], "calibench-import-report/1");
        assert_eq!(said["samples"], truth.len(), "{said:#}");
        assert!(said["log"]["understood"].to_string().contains(measured), "{said:#}");
        // The instrument was 0.12 s late; the motions say so to a few hundredths.
        assert!((said["log"]["shift_s"].as_f64().unwrap() + 0.12).abs() < 0.035, "{said:#}");
        let found = rows(&at.join(name).join("samples.csv"));
        assert_eq!(found.len(), truth.len());
        let mut squares = 0.0;
        for (k, (row, truth)) in found.iter().zip(&truth).enumerate() {
            for j in 1..=6 {
                let off = row[&format!("q{j}_deg")] - truth[&format!("q{j}_deg")];
                assert!(off.abs() < 0.002, "{name}, row {k}: joint {j} is {off} deg off");
                // The first rest has no motion before it.
                if k > 0 {
                    let came = truth[&format!("q{j}_deg")] - found[k - 1][&format!("q{j}_deg")];
                    assert_eq!(row[&format!("approach{j}")], came.signum(), "{name}, row {k}, joint {j}");
                }
            }
            // The tag is another point of the tool.
            if name != "frames" {
                let off: f64 = ["x_mm", "y_mm", "z_mm"].iter().map(|axis| (row[*axis] - truth[*axis]).powi(2)).sum();
                assert!(off.sqrt() < 0.05, "{name}, row {k} is {} mm off", off.sqrt());
                squares += off;
            }
            assert!(row["time_s"] > truth["begin_s"] - 0.5 && row["time_s"] < truth["begin_s"] + 1.0, "{name}, row {k}");
        }
        // Readings of 15 um an axis, about ten a rest.
        assert!((squares / truth.len() as f64).sqrt() < 0.015, "{name}");
    }
}

#[test]
fn a_recording_is_calibrated_by_one_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let recording = recordings().join("tracker");
    let recording = recording.to_str().unwrap();
    let said = done(at, &["calibrate", recording, "--robot", "ur5", "--noise", "15um", "-o", "one"]);
    assert!(said.contains("rests: 40, of which 40 with a measurement by /tracker"), "{said}");
    let of = |folder: &str| -> Value {
        serde_json::from_str(&fs::read_to_string(at.join(folder).join("judgement.json")).unwrap()).unwrap()
    };
    let one = of("one");
    let error = |name: &str| one["errors"][name]["mean_mm"].as_f64();
    let best = error("recommended").or(error("calibrated")).unwrap();
    assert!(best < 0.03 && error("nominal").unwrap() > 0.3, "{:#}", one["errors"]);
    // The rests can be looked at, and read again by their map.
    assert!(at.join("one/stills.csv").is_file() && at.join("one/map.toml").is_file());
    done(at, &["import", "generic", "one/stills.csv", "--map", "one/map.toml", "-o", "again"]);
    assert_eq!(rows(&at.join("again/samples.csv")).len(), 40);
    // Again into the same folder, with a robot and a note of one's own.
    fs::write(at.join("own.toml"), done(at, &["robots", "show", "ur5"])).unwrap();
    for _ in 0..2 {
        done(at, &["calibrate", recording, "--robot", "own.toml", "-o", "own"]);
        fs::write(at.join("own/note.txt"), "mine").unwrap();
        done(at, &["import", "log", recording, "--robot", "ur5", "-o", "dataset"]);
        fs::write(at.join("dataset/note.txt"), "mine").unwrap();
    }
    assert!(at.join("own/note.txt").is_file() && at.join("dataset/note.txt").is_file());
    // In two steps it is the same.
    done(at, &["import", "log", recording, "--robot", "ur5", "--noise", "15um", "-o", "dataset"]);
    done(at, &["calibrate", "dataset", "-o", "two"]);
    assert_eq!(one["errors"], of("two")["errors"]);
}

#[test]
fn a_minute_of_motion_is_calibrated_by_one_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let [joints, tracker] = ["joints.csv", "tracker.csv"].map(|name| recordings().join("moving").join(name));
    let files = [joints.to_str().unwrap(), tracker.to_str().unwrap()];
    let import =
        ["import", "log", files[0], files[1], "--robot", "ur5", "--moving", "--noise", "10um", "-o", "moved", "--json"];
    let said = json(at, &import);
    let log = &said["log"];
    // By who made the recording; its filter is 8 ms late.
    assert!((log["shift_s"].as_f64().unwrap() + 37.508).abs() < 1e-4, "{said:#}");
    assert!(log["shift_sigma_s"].as_f64().unwrap() < 1e-4, "{said:#}");
    assert!(log["understood"].to_string().contains("smooths over"), "{said:#}");
    assert!(at.join("moved/moments.csv").is_file());
    // In one step or in two.
    let told = done(at, &["calibrate", files[0], files[1], "--robot", "ur5", "--moving", "--noise", "10um", "-o", "one"]);
    assert!(told.contains("clocks matched: -37.508"), "{told}");
    done(at, &["calibrate", "moved", "-o", "two"]);
    let of = |folder: &str| -> Value {
        serde_json::from_str(&fs::read_to_string(at.join(folder).join("judgement.json")).unwrap()).unwrap()
    };
    assert_eq!(of("one")["errors"], of("two")["errors"]);
    // At poses at which it stands, which nobody fitted: the noise of the motion is not in it.
    let truth = recordings().join("moving/truth.csv");
    let still = ["import", "guess", truth.to_str().unwrap(), "--robot", "ur5", "-o", "still.toml"];
    done(at, &still);
    let still = ["import", "generic", truth.to_str().unwrap(), "--map", "still.toml", "--set-up-of", "one", "-o", "still"];
    done(at, &still);
    let judged = json(at, &["validate", "one/calibration.toml", "still", "--json"]);
    let mean = |state: &str| judged["states"][state]["mean_mm"].as_f64().unwrap();
    assert!(mean("calibrated") < 0.012 && mean("nominal") > 0.5, "{judged:#}");
}

#[test]
fn a_flag_of_logs_is_for_logs() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("table.csv"), "q1,x,y,z\n1,2,3,4\n").unwrap();
    for arguments in [
        ["calibrate", "table.csv", "--robot", "ur5", "-o", "o", "--still", "1s"],
        ["import", "generic", "table.csv", "--map", "m.toml", "-o=o", "--shift", "1s"],
        ["import", "generic", "table.csv", "--map", "m.toml", "-o=o", "--noise", "1mm"],
    ] {
        let output = calibench(at, &arguments);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(arguments[6]) && told.contains("logs") || told.contains("recordings"), "{told}");
        assert!(!at.join("o").exists());
    }
}
