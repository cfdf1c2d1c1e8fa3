//! `calibrate`: a table and a robot are enough; the errors before and after are those of the other verbs; the exit code says whether
//! a tolerance is met.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::oracles::data;
use crate::program::{calibench, done, json};

/// The first rows of the UR5's table, as its owners wrote it.
fn table(folder: &Path, rows: usize) {
    let text = fs::read_to_string(data("ur5-jacobi").join("3D_UR5_uncalibrated_grid_cleaned.csv")).unwrap();
    let every = text.lines().count() / rows;
    let kept: Vec<&str> = text.lines().enumerate().filter(|(k, _)| *k == 0 || k % every == 0).map(|(_, line)| line).collect();
    fs::write(folder.join("table.csv"), kept.join("\n") + "\n").unwrap();
}

fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer} in {value:#}"))
}

#[test]
fn a_table_and_a_robot_are_enough() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, 120);
    let output = calibench(at, &["calibrate", "table.csv", "--robot", "ur5", "--tolerance", "1mm", "-o", "ur5"]);
    let (said, told) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{told}\n{said}");
    assert!(said.lines().count() <= 26, "{said}");
    for part in [
        "samples fitted",
        "held out",
        "as delivered",
        "nominal",
        "calibrated",
        "inside the measured ranges",
        "Cause:",
        "Next: use",
    ] {
        assert!(said.contains(part), "no '{part}' in\n{said}");
    }
    let judged: Value = serde_json::from_str(&fs::read_to_string(at.join("ur5/judgement.json")).unwrap()).unwrap();
    assert_eq!(judged["format"], "calibench-judgement/1");
    assert!(number(&judged, "/errors/calibrated/mean_mm") < number(&judged, "/errors/nominal/mean_mm"), "{judged:#}");
    // The table says where the robot was told to go, some millimetres from where it was seen.
    let as_delivered = number(&judged, "/errors/as_delivered/mean_mm");
    assert!(as_delivered > 2.0 && as_delivered < 4.0, "{judged:#}");
    // Every number is that of the verb which has it alone.
    let validated = json(at, &["validate", "ur5/calibration.toml", "ur5", "--json"]);
    let last = if judged["errors"]["recommended"]["mean_mm"].is_number() { "recommended" } else { "calibrated" };
    for (key, of) in [("mean_mm", "/mean_mm"), ("max_mm", "/max_mm"), ("p95_mm", "/quantiles_mm/95")] {
        let ours = number(&judged, &format!("/errors/{last}/{key}"));
        assert!((ours - number(&validated, of)).abs() < 1e-9, "{key}: {ours} in {validated:#}");
    }
    // So says the page, and whoever diagnoses the recommended model is told the same next step.
    let page = fs::read_to_string(at.join("ur5/report.html")).unwrap();
    let data = page.split(r#"<script type="application/json" id="data">"#).nth(1).unwrap().split("</script>").next().unwrap();
    let page: Value = serde_json::from_str(data).unwrap();
    assert_eq!(page["states"], judged["errors"]);
    assert_eq!(page["judgement"], judged);
    let diagnosed = json(at, &["diagnose", "ur5", "--model", "ur5/model.toml", "--json"]);
    assert_eq!(diagnosed["advice"]["to_do"], judged["to_do"], "{:#}", diagnosed["advice"]);
    for file in ["calibration.toml", "model.toml", "report.html", "calibrated.urdf", "map.toml", "dataset.toml", "samples.csv"]
    {
        assert!(at.join("ur5").join(file).is_file(), "no {file}");
    }
    assert!(fs::metadata(at.join("ur5/calibration.toml")).unwrap().len() < 100_000);
    // Once more into the same folder, which is called like the robot.
    let again = calibench(at, &["calibrate", "table.csv", "--robot", "ur5", "-o", "ur5"]);
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
    // The folder is a dataset, and the same command on it gives the same errors.
    let again = json(at, &["calibrate", "ur5", "--tolerance", "1mm", "-o", "again", "--json"]);
    assert_eq!(again["errors"], judged["errors"]);
}

#[test]
fn a_tolerance_that_is_not_met_is_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    table(folder.path(), 60);
    let output = calibench(folder.path(), &["calibrate", "table.csv", "--robot", "ur5", "--tolerance", "1um", "-o", "ur5"]);
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("0.001 met by 0 of"), "{said}");
}

#[test]
fn what_is_missing_is_named_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, 60);
    let text = fs::read_to_string(at.join("table.csv")).unwrap();
    fs::copy(at.join("table.csv"), at.join("copy.csv")).unwrap();
    fs::write(at.join("short.csv"), text.lines().take(6).collect::<Vec<_>>().join("\n") + "\n").unwrap();
    for (arguments, problem) in [
        (vec!["calibrate", "short.csv", "--robot", "ur5", "-o", "ur5"], "short.csv: has only 5 rows"),
        (vec!["calibrate", "table.csv", "-o", "ur5"], "--robot is missing"),
        (vec!["calibrate", "absent.csv", "--robot", "ur5", "-o", "ur5"], "absent.csv"),
        (vec!["calibrate", "absent", "-o", "ur5"], "absent: is not there"),
        (vec!["calibrate", "table.csv", "copy.csv", "--robot", "ur5", "-o", "ur5"], "the same bytes as table.csv"),
        (vec!["calibrate", "table.csv", "--robot", "ur5", "--noise", "20", "-o", "ur5"], "such as 20um"),
        (vec!["calibrate", "table.csv", "--robot", "ur5", "--every", "30", "-o", "ur5"], "such as 30s"),
        (vec!["calibrate", "table.csv", "--robot", "kr6_r700", "-o", "ur5"], "do not fit this robot"),
    ] {
        let output = calibench(at, &arguments);
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && told.to_lowercase().contains(problem), "{arguments:?}: {told}");
        assert!(!at.join("ur5").exists(), "{arguments:?}");
    }
}

/// A row mistyped by millimetres is named on the first screen, with what else is wrong, and is to be looked at, whether it was fitted or
/// held out.
#[test]
fn a_mistyped_row_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, 80);
    let text = fs::read_to_string(at.join("table.csv")).unwrap();
    let right: Vec<String> = text.lines().map(str::to_owned).collect();
    let z = right[0].split(',').position(|title| title.trim() == "z_dif").expect("the table has it");
    let arguments = ["calibrate", "table.csv", "--robot", "ur5", "--noise", "20um", "--wide", "-o", "ur5"];
    let output = calibench(at, &arguments);
    assert!(!String::from_utf8_lossy(&output.stdout).contains("leave out"), "the table as it is has no such row");
    let samples = fs::read_to_string(at.join("ur5/samples.csv")).unwrap();
    let place = |title: &str| samples.lines().next().unwrap().split(',').position(|t| t == title).expect("a column");
    let [id, set] = ["id", "set"].map(place);
    let line_of = |wanted: &str| {
        let mut rows = samples.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>());
        let row = rows.find(|row| row[set] == wanted).expect("rows of both sets");
        row[id].rsplit(':').next().and_then(|line| line.parse::<usize>().ok()).expect("the line of the table") - 1
    };
    for (line, cause, to_do) in [
        (line_of(""), "disagrees with all others", "Next: measure table:"),
        (line_of("validation"), "Cause: ", "Next: measure again, or leave out, of the rows held out table:"),
    ] {
        let mut lines = right.clone();
        let mut fields: Vec<String> = lines[line].split(',').map(str::to_owned).collect();
        fields[z] = format!("{}", fields[z].parse::<f64>().unwrap() + 7.0);
        lines[line] = fields.join(",");
        fs::write(at.join("table.csv"), lines.join("\n") + "\n").unwrap();
        let output = calibench(at, &arguments);
        let said = String::from_utf8_lossy(&output.stdout);
        let told = String::from_utf8_lossy(&output.stderr);
        let found = said.lines().find(|line| line.starts_with("Cause: ")).unwrap_or_else(|| panic!("{said}{told}"));
        assert!(found.contains(cause), "{line}: {found}");
        assert!(said.contains(to_do), "{line}: {said}");
    }
}

/// A tracker bumped half-way is found in the order of the rows; told that the rows stand in it, the program corrects for it. The map
/// keeps what was said of the rows and of the noise, so that the same table is read so by every other verb.
#[test]
fn what_was_bumped_is_corrected_where_the_rows_have_an_order() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, 80);
    let text = fs::read_to_string(at.join("table.csv")).unwrap();
    let z = text.lines().next().unwrap().split(',').position(|title| title.trim() == "z_dif").expect("the table has it");
    let bumped = text.lines().enumerate().map(|(k, line)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if k > 40 {
            fields[z] = format!("{}", fields[z].parse::<f64>().unwrap() + 1.0);
        }
        fields.join(",") + "\n"
    });
    fs::write(at.join("table.csv"), bumped.collect::<String>()).unwrap();
    let calibrate = ["calibrate", "table.csv", "--robot", "ur5", "--noise", "20um", "--wide", "-o", "ur5"];
    let said = String::from_utf8_lossy(&calibench(at, &calibrate).stdout).into_owned();
    assert!(said.contains("if the rows are in the order of measurement, base or artifact was bumped once"), "{said}");
    assert!(said.contains("Next: if the rows stand in the order of measurement, calibrate again with `--every 30s`"), "{said}");
    // Every other screen of these rows says the same first, and nothing else beside it.
    let event = "base or artifact was bumped once";
    let report = fs::read_to_string(at.join("ur5/report.html")).unwrap();
    assert!(
        report.contains(&format!("\"headline\":\"If the rows are in the order of measurement, {event}")),
        "the report's headline"
    );
    for (verb, needed) in [("diagnose", "Verdict: unexplained without the times of the rows; if"), ("report", event)] {
        let said = done(at, &[verb, "ur5", "-o", "x.html"][..if verb == "report" { 4 } else { 2 }]);
        assert!(
            said.contains(needed) && !said.contains("many small effects") && !said.contains("CONTRIBUTES"),
            "{verb}: {said}"
        );
    }
    let said = done(at, &["plan", "next", "ur5", "--model", "ur5/model.toml"]);
    assert!(said.contains(event) && said.contains("Give the rows their times first"), "{said}");
    let judged =
        |of: &str| number(&serde_json::from_str(&fs::read_to_string(at.join("ur5/judgement.json")).unwrap()).unwrap(), of);
    let before = judged("/errors/calibrated/mean_mm");
    let said = done(at, &[&calibrate[..], &["--every", "30s"]].concat());
    assert!(said.contains("base bumped after 1185 s") && !said.contains("--every"), "{said}");
    assert!(judged("/errors/recommended/mean_mm") < 0.3 * before, "{before}: {said}");
    done(at, &["import", "generic", "--map", "ur5/map.toml", "table.csv", "-o", "again"]);
    let dataset = fs::read_to_string(at.join("again/dataset.toml")).unwrap();
    let samples = fs::read_to_string(at.join("again/samples.csv")).unwrap();
    // A dataset without times is told so too, and one that has them is not told twice.
    let time = samples.lines().next().unwrap().split(',').position(|title| title == "time_s").expect("a column");
    let kept =
        |line: &str| line.split(',').enumerate().filter(|(k, _)| *k != time).map(|(_, v)| v).collect::<Vec<_>>().join(",");
    fs::create_dir(at.join("untimed")).unwrap();
    fs::copy(at.join("again/dataset.toml"), at.join("untimed/dataset.toml")).unwrap();
    fs::write(at.join("untimed/samples.csv"), samples.lines().map(|line| kept(line) + "\n").collect::<String>()).unwrap();
    let said = done(at, &["calibrate", "untimed", "--every", "30s", "--wide", "-o", "timed"]);
    assert!(said.contains("base bumped after 1185 s"), "{said}");
    let twice = calibench(at, &["calibrate", "again", "--every", "30s", "-o", "twice"]);
    let told = String::from_utf8_lossy(&twice.stderr).into_owned();
    assert!(twice.status.code() == Some(2) && told.contains("have them (time_s)"), "{told}");
    assert!(dataset.contains("point_um = 20.0") && samples.lines().next().unwrap().contains("time_s"), "{dataset}");
}

#[test]
fn orientations_are_fitted_and_judged_beside_positions() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // Nobody states a noise: how orientations weigh beside positions is a guess, and they count all the same.
    let table = data("ur10-ipa").join("Series_D/measurements_iso_cubes.csv");
    let said = done(at, &["calibrate", table.to_str().unwrap(), "--robot", "ur10", "-o", "one"]);
    let states = serde_json::from_str::<Value>(&fs::read_to_string(at.join("one/judgement.json")).unwrap()).unwrap();
    let of = |state: &str| number(&states, &format!("/errors/{state}/orientation_mean_deg"));
    assert!(of("recommended") < 0.04 && of("recommended") < 0.8 * of("nominal"), "{:#}", states["errors"]);
    assert!(said.contains(&format!("recommended {:.3} deg.", of("recommended"))), "{said}");
    // Its file is that of `identify` with its model.
    done(at, &["identify", "one", "--model", "one/model.toml", "-o", "two.toml"]);
    let [one, two] = ["one/calibration.toml", "two.toml"].map(|file| json(at, &["validate", file, "one", "--json"]));
    let near = |of: &str| (number(&one, of) - number(&two, of)).abs() < 1e-3 * number(&two, of);
    assert!(near("/mean_mm") && near("/orientation/mean_deg"), "{one:#} {two:#}");
    assert_eq!(number(&one, "/mean_mm"), number(&states, "/errors/recommended/mean_mm"));
}

#[test]
fn columns_with_the_names_of_the_joints_stand_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, 60);
    // As the driver of Universal Robots publishes them, elbow first.
    const PUBLISHED: [(&str, usize); 6] = [
        ("elbow_joint", 2),
        ("shoulder_lift_joint", 1),
        ("shoulder_pan_joint", 0),
        ("wrist_1_joint", 3),
        ("wrist_2_joint", 4),
        ("wrist_3_joint", 5),
    ];
    done(at, &["calibrate", "table.csv", "--robot", "ur5", "-o", "numbered"]);
    let samples = fs::read_to_string(at.join("numbered/samples.csv")).unwrap();
    let titles: Vec<&str> = samples.lines().next().unwrap().split(',').collect();
    let place = |title: &str| titles.iter().position(|t| *t == title).unwrap();
    let named = samples.lines().enumerate().map(|(k, line)| {
        let fields: Vec<&str> = line.split(',').collect();
        let joints = PUBLISHED.map(|(name, j)| if k == 0 { name } else { fields[place(&format!("q{}_deg", j + 1))] });
        let position = ["x_mm", "y_mm", "z_mm"].map(|title| fields[place(title)]);
        format!("{},{}\n", joints.join(","), position.join(","))
    });
    fs::write(at.join("named.csv"), named.collect::<String>()).unwrap();
    done(at, &["calibrate", "named.csv", "--robot", "ur5", "-o", "named"]);
    let again = fs::read_to_string(at.join("named/samples.csv")).unwrap();
    let rows = |text: &str| -> Vec<Vec<String>> {
        let titles: Vec<String> = text.lines().next().unwrap().split(',').map(str::to_owned).collect();
        let joints = (1..=6).map(|j| titles.iter().position(|t| *t == format!("q{j}_deg")).unwrap()).collect::<Vec<_>>();
        text.lines()
            .skip(1)
            .map(|l| {
                let f: Vec<&str> = l.split(',').collect();
                joints.iter().map(|&k| f[k].to_owned()).collect()
            })
            .collect()
    };
    assert_eq!(rows(&samples), rows(&again));
}

/// Adds millimetres to z of every so many-th row of the table, and returns the number of these rows.
fn mistype(at: &Path, every: usize) -> usize {
    let text = fs::read_to_string(at.join("table.csv")).unwrap();
    let z = text.lines().next().unwrap().split(',').position(|title| title.trim() == "z_dif").expect("the table has it");
    let mut count = 0;
    let line = |(k, line): (usize, &str)| {
        if k % every != every - 1 {
            return line.to_owned();
        }
        count += 1;
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        fields[z] = format!("{}", fields[z].parse::<f64>().unwrap() + if count % 2 == 0 { 7.0 } else { -9.0 });
        fields.join(",")
    };
    let lines: Vec<String> = text.lines().enumerate().map(line).collect();
    fs::write(at.join("table.csv"), lines.join("\n") + "\n").unwrap();
    count
}

/// One row in fourteen is mistyped by millimetres: none of them is fitted, whether the noise is stated or not.
#[test]
fn mistyped_rows_are_set_aside_together() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, 100);
    assert!(mistype(at, 14) >= 5);
    for noise in [&["--noise", "20um"][..], &[]] {
        let output = calibench(at, &[&["calibrate", "table.csv", "--robot", "ur5", "-o", "ur5"], noise].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let model = fs::read_to_string(at.join("ur5/model.toml")).unwrap();
        assert!(model.matches("outlier:").count() >= 4, "{model}");
        // Some of them are held out: half of the rows are not.
        let validated = json(at, &["validate", "ur5/calibration.toml", "ur5", "--json"]);
        let median = number(&validated, "/quantiles_mm/50");
        assert!(median < 0.2, "{median} mm, and with the rows as they were 0.1 mm");
    }
}

#[test]
fn a_table_may_come_from_a_stream() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, 60);
    let fed = |tail: &str| {
        let program = env!("CARGO_BIN_EXE_calibench");
        let script = format!("{program} calibrate {tail} --robot ur5 -o ur5");
        let output = Command::new("bash").current_dir(at).args(["-c", &script]).output().unwrap();
        let (said, told) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{script}: {told}");
        said.into_owned()
    };
    let rows = fs::read_to_string(at.join("table.csv")).unwrap().lines().count() - 1;
    let read = format!("Read: {rows} rows");
    assert!(fed("- < table.csv").contains(&read));
}
