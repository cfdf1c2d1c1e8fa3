//! A tracker in place of a gauge, over the wires: poses are planned and driven, a campaign that is killed goes on, a beam that is
//! broken costs its points, and what was measured makes the arm accurate. Or somebody jogs, and the same program reads.

#![cfg(unix)]

use std::io::Write;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use calibench::cell::StopRequest;
use calibench::measure::campaign::cell::read_cell;
use calibench::measure::dataset::Measured;
use calibench::measure::dataset::file::read_dataset;
use calibench::measure::poses::read_plan;

use crate::served::{Bench, Make, Served};

const PROGRAM: &str = env!("CARGO_BIN_EXE_calibench");

/// Points of a plan here: enough for 31 parameters.
const POINTS: usize = 40;

fn calibench(bench: &Bench, arguments: &[&str]) -> Output {
    Command::new(PROGRAM).args(arguments).current_dir(bench.path("")).stdin(Stdio::null()).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A served cell with a tracker, its cell file without indicators, a station and a plan of points.
fn set_up(make: Make, faults: &[&str]) -> (Bench, Served) {
    let bench = Bench::small_of(make);
    let served = bench.serve(&[&["--indicator-port", "0", "--tracker-port", "0"], faults].concat());
    let cell = bench.write_cell(&served, "", "", "");
    let keys = std::fs::read_to_string(&cell).unwrap();
    let without_gauge = keys.split("[[indicator]]").next().unwrap().to_owned();
    let named = without_gauge.replace("surroundings.scene", "scenario = \"scenario.toml\"\nsurroundings.scene");
    std::fs::write(&cell, named).unwrap();
    let station = format!(
        "format = \"calibench-station/1\"\ncontroller.kind = \"typed\"\n[instrument]\naddress = \"{}\"\ntrigger = 'M\\n'\nline = \"{{name}},{{x}},{{y}},{{z}}\"\ntimeout_s = 0.5\n",
        served.tracker.as_ref().unwrap()
    );
    std::fs::write(bench.path("station.toml"), station).unwrap();
    let planned = calibench(&bench, &["plan", "cell.toml", "--points", &POINTS.to_string(), "-o", "points.toml"]);
    assert!(planned.status.success(), "{}", text(&planned.stderr));
    (bench, served)
}

/// The command that measures the points.
fn measure(bench: &Bench, more: &[&str]) -> Command {
    let mut command = Command::new(PROGRAM);
    command.args([
        "measure",
        "--cell",
        "cell.toml",
        "--plan",
        "points.toml",
        "--instrument",
        "station.toml",
        "--yes",
        "-o",
        "points",
    ]);
    command.args(more).current_dir(bench.path("")).stdin(Stdio::null());
    command
}

/// Mean held-out error of nominal and calibrated arm, mm, of what `calibrate` says of the points.
fn errors(bench: &Bench) -> [f64; 2] {
    let said = calibench(bench, &["calibrate", "points", "-o", "result", "--json"]);
    assert!(said.status.success(), "{}", text(&said.stderr));
    let document: serde_json::Value = serde_json::from_slice(&said.stdout).unwrap();
    ["nominal", "calibrated"].map(|name| document["errors"][name]["mean_mm"].as_f64().unwrap())
}

#[test]
fn a_campaign_of_points_goes_on_and_makes_the_arm_accurate() {
    for make in [Make::Kuka, Make::Ur] {
        let (bench, served) = set_up(make, &[]);
        let plan = read_plan(&bench.path("points.toml"), &bench.cell()).unwrap();
        assert!(plan.poses.iter().all(|pose| pose.ball.is_none()) && plan.wanted() == POINTS && plan.ways.is_some());
        // Killed once some are in the journal.
        let mut first = measure(&bench, &[]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let journal = bench.path("points.journal");
        let lines = || std::fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
        while lines() < POINTS / 3 {
            assert!(first.try_wait().unwrap().is_none(), "it ended by itself");
            std::thread::sleep(Duration::from_millis(5));
        }
        first.kill().unwrap();
        first.wait().unwrap();
        let kept = lines() - 1;
        assert!(kept < POINTS, "{kept} points before the kill");
        let refused = measure(&bench, &[]).output().unwrap();
        assert_eq!(refused.status.code(), Some(2), "{}", text(&refused.stderr));
        assert!(text(&refused.stderr).contains("--resume"), "{}", text(&refused.stderr));
        let went_on = measure(&bench, &["--resume"]).output().unwrap();
        assert!(went_on.status.success(), "{}", text(&went_on.stderr));
        assert!(text(&went_on.stdout).contains(&format!("{POINTS} of {POINTS} points measured; dataset in points")));
        assert!(!journal.exists());
        let dataset = read_dataset(&bench.path("points")).unwrap();
        assert!(dataset.base_found && dataset.samples.len() == POINTS);
        assert!(dataset.samples.iter().all(|s| matches!(s.measured, Measured::Point(_)) && s.approach.is_some()));
        // It is there, and is not measured again.
        let again = measure(&bench, &["--resume"]).output().unwrap();
        assert_eq!(again.status.code(), Some(2));
        assert!(text(&again.stderr).contains("holds a dataset already"), "{}", text(&again.stderr));
        let [nominal, calibrated] = errors(&bench);
        assert!(nominal > 0.5 && calibrated < 0.25 * nominal, "{make:?}: {nominal:.3} mm, then {calibrated:.3} mm");
        drop(served);
    }
}

#[test]
fn a_broken_beam_costs_its_points_and_nothing_else() {
    // Two triggers a pose: the 5th pose, and no other in full.
    let (bench, served) = set_up(Make::Kuka, &["--fault", "beam@7", "--fault", "beam@9", "--fault", "beam@10"]);
    let done = measure(&bench, &[]).output().unwrap();
    assert!(done.status.success(), "{}", text(&done.stderr));
    let said = text(&done.stdout);
    assert!(said.contains(&format!("{} of {POINTS} points measured; without a point: t0", POINTS - 1)), "{said}");
    assert!(text(&done.stderr).contains("no point in pose 't0"), "{}", text(&done.stderr));
    drop(served);

    // One that stays broken ends it: what was measured is kept, and the arm is at home.
    let (bench, served) = set_up(Make::Kuka, &["--fault", "beam@11+"]);
    let ended = measure(&bench, &[]).output().unwrap();
    assert_eq!(ended.status.code(), Some(3), "{}", text(&ended.stderr));
    let said = text(&ended.stderr);
    assert!(said.contains("no point in 3 poses in succession") && said.contains("10 points are kept"), "{said}");
    let home = read_plan(&bench.path("points.toml"), &bench.cell()).unwrap().ways.unwrap().home;
    assert!(served.joints().iter().zip(&home).all(|(q, home)| (q - home).abs() < 1e-3));
}

#[test]
fn plans_and_instruments_that_do_not_belong_together_are_refused() {
    let (bench, _served) = set_up(Make::Kuka, &[]);
    for (arguments, said) in [
        (&["--plan", "points.toml"][..], "the plan is of points; give --instrument STATION"),
        (
            &["--plan", "plan.toml", "--instrument", "station.toml"],
            "is a plan of probings; `plan CELL --points N` makes one of points",
        ),
        (&["--plan", "plan.toml"], "has no indicators; add three [[indicator]], or give --instrument"),
    ] {
        let whole = [&["measure", "--cell", "cell.toml", "--yes", "-o", "other"], arguments].concat();
        let refused = calibench(&bench, &whole);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        assert!(text(&refused.stderr).contains(said), "{}", text(&refused.stderr));
    }
    let scenario = calibench(&bench, &["plan", "scenario.toml", "--points", "40"]);
    assert!(text(&scenario.stderr).contains("is not a cell"), "{}", text(&scenario.stderr));
    std::fs::write(bench.path("typed.toml"), "format = \"calibench-station/1\"\ncontroller.kind = \"typed\"\n").unwrap();
    let whole =
        ["measure", "--cell", "cell.toml", "--plan", "points.toml", "--instrument", "typed.toml", "--yes", "-o", "other"];
    let refused = calibench(&bench, &whole);
    assert!(text(&refused.stderr).contains("has no instrument that is connected"), "{}", text(&refused.stderr));
    let rehearsed =
        calibench(&bench, &["measure", "--cell", "cell.toml", "--plan", "points.toml", "--dry-run", "--film", "film.html"]);
    assert!(rehearsed.status.success(), "{}", text(&rehearsed.stderr));
    assert!(!text(&rehearsed.stdout).contains("at each contact"), "{}", text(&rehearsed.stdout));
}

#[test]
fn points_of_another_unit_end_the_campaign_at_once() {
    let (bench, served) = set_up(Make::Kuka, &[]);
    let station = std::fs::read_to_string(bench.path("station.toml")).unwrap();
    std::fs::write(bench.path("station.toml"), format!("{station}unit = \"m\"\n")).unwrap();
    let ended = measure(&bench, &[]).output().unwrap();
    assert_eq!(ended.status.code(), Some(2), "{}", text(&ended.stderr));
    assert!(text(&ended.stderr).contains("correct `unit` and `line` of the station"), "{}", text(&ended.stderr));
    assert!(!bench.path("points.journal").exists() && !bench.path("points").exists());
    drop(served);
}

/// Somebody who jogs: moves the arm through the driver of the cell, and types.
#[test]
fn whoever_jogs_measures_with_the_same_program() {
    for make in [Make::Kuka, Make::Ur] {
        let (bench, served) = set_up(make, &[]);
        let kind = if make == Make::Kuka { "kuka" } else { "ur" };
        let station = std::fs::read_to_string(bench.path("station.toml")).unwrap();
        let station = station.replace(
            "controller.kind = \"typed\"",
            &format!("[controller]\nkind = \"{kind}\"\naddress = \"{}\"", served.robot),
        );
        std::fs::write(bench.path("hand.toml"), format!("{station}[still]\nwait_s = 0.2\n")).unwrap();
        let mut process = Command::new(PROGRAM)
            .args(["measure", "--by-hand", "hand.toml", "-o", "hand.csv"])
            .current_dir(bench.path(""))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut keyboard = process.stdin.take().unwrap();
        let cell = read_cell(&bench.path("cell.toml")).unwrap();
        let mut robot = cell.open_robot(StopRequest::default()).unwrap();
        robot.prepare(100, &cell.flange_from_tool()).unwrap();
        let journal = bench.path("hand.csv.journal");
        let lines = || std::fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
        let home = robot.joints().unwrap();
        for k in 0..3 {
            let q: Vec<f64> = home.iter().enumerate().map(|(j, q)| q + if j == 5 { 0.1 * f64::from(k) } else { 0.0 }).collect();
            robot.move_joints(&q).unwrap();
            writeln!(keyboard).unwrap();
            let wanted = 2 + usize::try_from(k).unwrap();
            while lines() < wanted {
                assert!(process.try_wait().unwrap().is_none(), "it ended by itself");
                std::thread::sleep(Duration::from_millis(20));
            }
        }
        writeln!(keyboard, "q").unwrap();
        let done = process.wait_with_output().unwrap();
        assert!(done.status.success(), "{}", text(&done.stderr));
        assert!(text(&done.stdout).contains("3 postures in hand.csv"), "{}", text(&done.stdout));
        let table = std::fs::read_to_string(bench.path("hand.csv")).unwrap();
        let column = |row: &str, k: usize| row.split(',').nth(k).unwrap().parse::<f64>().unwrap();
        let sixth: Vec<f64> = table.lines().skip(1).map(|row| column(row, 6)).collect();
        for (k, q) in sixth.iter().enumerate() {
            assert!((q - (home[5] + 0.1 * k as f64).to_degrees()).abs() < 0.02, "{table}");
        }
        assert!(!journal.exists());
    }
}
