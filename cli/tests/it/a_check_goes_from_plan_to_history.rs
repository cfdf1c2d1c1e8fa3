//! `keep check` on a cell: the sentinels are planned, probed until the answer is sure, and kept in a history. It goes on after an
//! interruption, and refuses what it cannot use before anything moves.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::program::{calibench, scenario};
use serde_json::Value;
use tempfile::TempDir;

/// A short plan in the cell of table 8, seen by an instrument of its own.
const SCENARIO: &str = "format = \"calibench-scenario/1\"\nextends = \"BASE\"\n[plan]\npool_per_ball = 150\nstarts = 1\n";

fn ran(folder: &Path, line: &str) -> Output {
    let output = calibench(folder, &line.split(' ').collect::<Vec<_>>());
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn refused(folder: &Path, line: &str, words: &str) {
    let output = calibench(folder, &line.split(' ').collect::<Vec<_>>());
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{line}: {said}");
    assert!(said.contains(words) && said.trim_end().lines().count() == 1, "{line}: {said}");
}

/// A planned and measured cell with its calibration, and the plan of its sentinels.
fn calibrated() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cell.toml"), SCENARIO.replace("BASE", &scenario("table8.toml"))).unwrap();
    ran(folder.path(), "plan cell.toml -o plan.toml");
    ran(folder.path(), "measure cell.toml --plan plan.toml -o then");
    ran(folder.path(), "identify then -o calibration.toml");
    ran(folder.path(), "keep check calibration.toml --then then --plan plan.toml -o sentinels.toml");
    folder
}

const CHECK: &str = "keep check calibration.toml --then then";

#[test]
fn what_is_planned_is_probed_and_kept() {
    let folder = calibrated();
    let at = folder.path();
    let plan = fs::read_to_string(at.join("sentinels.toml")).unwrap();
    assert_eq!(plan.matches("[[pose]]").count(), 5, "{plan}");
    assert!(plan.contains("home_deg"), "the sentinels have their ways: {plan}");

    let first = ran(
        at,
        &format!("{CHECK} --cell cell.toml --plan sentinels.toml -o now/1 --history history.toml --on 2025-12-01 --json"),
    );
    let document: Value = serde_json::from_slice(&first.stdout).unwrap();
    assert_eq!((&document["verdict"], &document["samples"]), (&"valid".into(), &5.into()), "{document}");
    let power = document["power"].as_array().unwrap();
    let slip = power.iter().find(|p| p["condition"] == "joint_slipped:3").unwrap();
    assert!(slip["unit"] == "deg" && (1e-4..0.1).contains(&slip["change"].as_f64().unwrap()), "{slip}");
    assert!(slip["at"][0]["found"].as_f64().unwrap() >= 0.95, "{slip}");
    let line = format!(
        "{CHECK} --cell cell.toml --plan sentinels.toml --visit 2 -o now/2 --history history.toml --on 2025-12-08 --page page.html"
    );
    let second = ran(at, &line);
    let said = String::from_utf8_lossy(&second.stdout);
    assert!(said.contains("Control charts of 2 checks: nothing drifts"), "{said}");
    assert!(
        said.contains("These samples would have shown, with 95 % probability: ") && said.contains(", a joint off by"),
        "{said}"
    );
    let samples = |name: &str| fs::read_to_string(at.join(name).join("samples.csv")).unwrap();
    assert_ne!(samples("now/1"), samples("now/2"), "each visit has noise of its own");
    let page = fs::read_to_string(at.join("page.html")).unwrap();
    assert!(page.contains("zero of joint 3") && page.contains("2025-12-08") && !page.contains("<script"), "{page}");
    let history = fs::read_to_string(at.join("history.toml")).unwrap();
    assert_eq!(history.matches("[[check]]").count(), 2);
    assert!(history.contains("dataset = \"now/1\""), "paths are seen from the file: {history}");

    // The same check as a dataset says the same.
    let again = ran(at, &format!("{CHECK} now/1 --json"));
    let again: Value = serde_json::from_slice(&again.stdout).unwrap();
    assert_eq!(again["looks"], document["looks"]);

    // Rows of the campaign with fewer digits are not new measurements, and are not taken for any without a word.
    fs::create_dir(at.join("rounded")).unwrap();
    fs::copy(at.join("then/dataset.toml"), at.join("rounded/dataset.toml")).unwrap();
    let campaign = fs::read_to_string(at.join("then/samples.csv")).unwrap();
    let titles: Vec<&str> = campaign.lines().next().unwrap().split(',').collect();
    let rounded = |line: &str| {
        let cells = line.split(',').zip(&titles).map(|(cell, title)| match cell.parse::<f64>() {
            Ok(number) if title.ends_with("_deg") => format!("{number:.4}"),
            _ => cell.to_owned(),
        });
        cells.collect::<Vec<_>>().join(",")
    };
    let rows: Vec<String> = campaign.lines().take(8).map(rounded).collect();
    fs::write(at.join("rounded/samples.csv"), rows.join("\n") + "\n").unwrap();
    let said = ran(at, &format!("{CHECK} rounded")).stdout;
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(said.starts_with("These samples repeat those of the campaign "), "{said}");

    refused(at, &format!("{CHECK} now/2 --history history.toml --on 2025-12-09"), "is in history.toml already");
    refused(
        at,
        &format!("{CHECK} now/1 --history history.toml --on 2025-11-01"),
        "the last check in history.toml is of 2025-12-08",
    );
    refused(at, &format!("{CHECK} now/1 --history history.toml --on 1.12.2026"), "is not a date");
    refused(at, &format!("{CHECK} now/1 --history history.toml --on 9999-12-01"), "is after today");
    // A copy under another name is not a second check.
    fs::create_dir(at.join("now/3")).unwrap();
    for name in ["samples.csv", "dataset.toml"] {
        fs::copy(at.join("now/2").join(name), at.join("now/3").join(name)).unwrap();
    }
    refused(
        at,
        &format!("{CHECK} now/3 --history history.toml --on 2025-12-09"),
        "of its rows are also those of the check of 2025-12-08",
    );
    // What was written by hand is held to what the program writes: line, key and remedy.
    let dataset = history.lines().find(|line| line.starts_with("dataset")).unwrap().to_owned();
    let twice = history.clone() + &format!("[[check]]\non = \"2025-12-09\"\n{dataset}\nverdict = \"valid\"\n");
    let digest = history.lines().find(|line| line.starts_with("calibration_digest")).unwrap();
    for (wrong, said) in [
        (
            history.replace(digest, "calibration_digest = \"0123456789abcdef\""),
            "its checks were judged against another calibration of the same name; begin a new history",
        ),
        (
            history.replacen("verdict = \"valid\"", "verdict = \"fine\"", 1),
            "check[0].verdict: is 'fine'; write `valid` or `changed`",
        ),
        (history.replacen("on = \"2025-", "on = \"25-", 1), "check[0].on: is '25-"),
        (twice, "list every dataset once"),
    ] {
        fs::write(at.join("history.toml"), &wrong).unwrap();
        refused(at, &format!("{CHECK} now/1 --history history.toml --on 2025-12-31"), said);
    }
    fs::write(at.join("history.toml"), &history).unwrap();
    fs::copy(at.join("calibration.toml"), at.join("other.toml")).unwrap();
    refused(at, "keep check other.toml --then then now/1 --history history.toml --on 2026-01-02", "begin another history");
    assert_eq!(fs::read_to_string(at.join("history.toml")).unwrap(), history, "a refused check leaves the history as it was");
    // What was measured on another day does not answer for today: nothing moves, and nothing is said to hold.
    for line in ["", " --resume", " --history new.toml --on 2026-01-02"] {
        refused(at, &format!("{CHECK} --cell cell.toml --plan sentinels.toml -o now/1{line}"), "was measured already");
    }
    assert!(!at.join("new.toml").exists());
}

#[test]
fn a_slipped_tool_is_found_and_the_poses_left_are_not_probed() {
    let folder = calibrated();
    let at = folder.path();
    // The gauge was taken off and put back, a tenth of a millimetre from where it was: its owner does not know.
    let slipped = fs::read_to_string(at.join("cell.toml")).unwrap() + "[truth.tool]\nsigma_um = 150\n";
    fs::write(at.join("slipped.toml"), slipped).unwrap();
    let line = format!("{CHECK} --cell slipped.toml --plan sentinels.toml -o now --history history.toml --on 2025-12-01");
    let output = calibench(at, &line.split(' ').collect::<Vec<_>>());
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("the tool has moved on the flange"), "{said}");
    let samples = fs::read_to_string(at.join("now/samples.csv")).unwrap().lines().count() - 1;
    assert!(samples < 5, "{samples} poses were probed although fewer name it");
    // The answer is printed at every level, and whoever closes the pipe gets the same exit code.
    let judged = format!("{CHECK} now");
    for level in ["-q", "-qq"] {
        let quiet = calibench(at, &format!("{judged} {level}").split(' ').collect::<Vec<_>>());
        let said = String::from_utf8_lossy(&quiet.stdout).into_owned();
        assert!(quiet.status.code() == Some(1) && said.starts_with("Changed: the tool has moved"), "{level}: {said}");
    }
    let mut closed = Command::new(env!("CARGO_BIN_EXE_calibench"));
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let closed = closed.current_dir(at).args(judged.split(' ')).stdout(writer).status().unwrap();
    assert_eq!(closed.code(), Some(1), "a closed pipe changes no verdict");
    // It is mended. What was found before is not a drift of what is healthy now.
    for (visit, day) in [(2, "2025-12-02"), (3, "2025-12-03"), (4, "2025-12-04")] {
        let healthy = format!(
            "{CHECK} --cell cell.toml --plan sentinels.toml --visit {visit} -o later{visit} --history history.toml --on {day}"
        );
        let said = String::from_utf8(ran(at, &healthy).stdout).unwrap();
        assert!(said.contains("The calibration holds") && said.contains("nothing drifts"), "{said}");
    }
}

#[test]
fn poses_that_cannot_be_compared_are_refused_before_anything_moves() {
    let folder = calibrated();
    let at = folder.path();
    let elsewhere = fs::read_to_string(at.join("sentinels.toml")).unwrap();
    let (before, rest) = elsewhere.split_once("contact_deg = [").unwrap();
    let (joints, after) = rest.split_once(']').unwrap();
    let moved: Vec<String> = joints.split(',').map(|q| (q.trim().parse::<f64>().unwrap_or(0.0) + 6.0).to_string()).collect();
    fs::write(at.join("elsewhere.toml"), format!("{before}contact_deg = [{}]{after}", moved.join(", "))).unwrap();
    refused(
        at,
        &format!("{CHECK} --cell cell.toml --plan elsewhere.toml -o now"),
        "was not measured when the robot was calibrated",
    );
    assert!(!at.join("now").exists() && !at.join("now.journal").exists());
    // Nor is the campaign compared with itself, or with samples that are described with another tool.
    refused(at, &format!("{CHECK} then"), "is the campaign itself");
    fs::create_dir(at.join("copied")).unwrap();
    let [rows, described] = ["samples.csv", "dataset.toml"].map(|name| fs::read_to_string(at.join("then").join(name)).unwrap());
    fs::write(at.join("copied/samples.csv"), rows.lines().take(6).collect::<Vec<_>>().join("\n")).unwrap();
    fs::write(at.join("copied/dataset.toml"), described).unwrap();
    refused(at, &format!("{CHECK} copied"), "mostly rows of it");
    fs::create_dir(at.join("retooled")).unwrap();
    fs::copy(at.join("then/samples.csv"), at.join("retooled/samples.csv")).unwrap();
    let described = fs::read_to_string(at.join("then/dataset.toml")).unwrap();
    fs::write(at.join("retooled/dataset.toml"), described.replacen("x_mm = 60.0", "x_mm = 61.0", 1)).unwrap();
    refused(at, &format!("{CHECK} retooled"), "are not those of the calibration");
    // Nor is the campaign of another arm taken for the one that was calibrated: both would be found unchanged.
    let other = fs::read_to_string(at.join("cell.toml")).unwrap() + "[truth.effects.mdh]\ntheta3_deg = 0.3\n";
    fs::write(at.join("other.toml"), other).unwrap();
    ran(at, "measure other.toml --plan plan.toml -o other");
    for dataset in ["then", "other"] {
        refused(at, &format!("keep check calibration.toml --then other {dataset}"), "is not the campaign that was calibrated");
    }
}
