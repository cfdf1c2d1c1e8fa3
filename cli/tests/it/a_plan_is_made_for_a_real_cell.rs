//! `plan CELL` makes the plan that the referenced scenario gives, with the names of the cell's own dataset and clear of the bodies
//! that the cell file names, and rejects a scenario of another cell.

use std::path::Path;
use std::process::{Command, Output};

use calibench::measure::campaign::cell::read_cell;
use calibench::measure::dataset::file::write_dataset;
use calibench::measure::dataset::{Dataset, Measured, Sample};
use calibench::measure::poses::read_plan;
use calibench::robot::solids::{Solid, Surroundings, SweptCheck};
use calibench_sim::scenario::load_scenario;
use nalgebra::Vector3;
use tempfile::TempDir;

const CELL: &str = "format = \"calibench-cell/1\"
dataset = \"cell/dataset.toml\"
scenario = \"scenario.toml\"
[robot]
address = \"127.0.0.1:7000\"
[[indicator]]
axis = \"x\"
address = \"127.0.0.1:1\"
[[indicator]]
axis = \"y\"
address = \"127.0.0.1:2\"
[[indicator]]
axis = \"z\"
address = \"127.0.0.1:3\"
";

/// A cell file with its dataset after `change`, and the scenario of the unchanged cell.
fn folder(cell: &str, change: impl FnOnce(&mut Dataset)) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let paper = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/paper.toml");
    let text = format!(
        "format = \"calibench-scenario/1\"\nextends = \"{}\"\n[plan]\npool_per_ball = 100\nstarts = 1\n",
        paper.display()
    );
    std::fs::write(folder.path().join("scenario.toml"), text).unwrap();
    let mut dataset = load_scenario(&folder.path().join("scenario.toml")).unwrap().dataset();
    dataset.samples = vec![Sample::new("a", vec![0.0; 6], Measured::Ball { ball: 0, reading: None })];
    change(&mut dataset);
    write_dataset(&dataset, &folder.path().join("cell")).unwrap();
    std::fs::write(folder.path().join("cell.toml"), cell).unwrap();
    folder
}

fn plan(folder: &TempDir, file: &str, output: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder.path()).args(["plan", file, "-o", output]).output().unwrap()
}

#[test]
fn it_is_the_plan_of_the_scenario() {
    let folder = folder(CELL, |_| {});
    for (file, output) in [("cell.toml", "by-cell.toml"), ("scenario.toml", "by-scenario.toml")] {
        let done = plan(&folder, file, output);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("by-cell.toml"), read("by-scenario.toml"));
    let cell = read_cell(&folder.path().join("cell.toml")).unwrap();
    assert!(read_plan(&folder.path().join("by-cell.toml"), &cell.dataset).unwrap().poses.len() >= 80);
}

#[test]
fn it_is_clear_of_the_bodies_of_the_cell() {
    let cell = CELL.replace("[robot]", "surroundings.scene = \"scene.toml\"\n[robot]");
    let folder = folder(&cell, |_| {});
    let at = |name: &str| folder.path().join(name);
    let planned = |file: &str| {
        let done = plan(&folder, file, "plan.toml");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        std::fs::read_to_string(at("plan.toml")).unwrap()
    };
    let mut scene = load_scenario(&at("scenario.toml")).unwrap().scene();
    scene.write(&at("scene.toml")).unwrap();
    let open = planned("cell.toml");
    assert_eq!(open, planned("scenario.toml"), "the bodies are those of the scenario");
    // A post where the arm would pass.
    let least = |text: &str, post: &Solid| {
        let cell = read_cell(&at("cell.toml")).unwrap().dataset;
        let bodies = Surroundings { fixed: vec![post.clone()], carried: Vec::new() };
        std::fs::write(at("plan.toml"), text).unwrap();
        let poses = read_plan(&at("plan.toml"), &cell).unwrap().poses;
        let mut swept = SweptCheck::new(&cell.robot, &cell.base, &cell.tool, &bodies);
        let gaps = poses.iter().filter_map(|p| swept.narrowest(&p.approach, &p.contact, 0.0, None));
        gaps.map(|gap| gap.clearance.distance).fold(f64::INFINITY, f64::min)
    };
    let post = Solid::capsule("post", 0, [Vector3::new(-0.3, 0.3, 0.0), Vector3::new(-0.3, 0.3, 0.8)], 0.03);
    assert!(least(&open, &post) <= 0.0, "the post stands in the way");
    scene.fixed.push(post.clone());
    scene.write(&at("scene.toml")).unwrap();
    assert!(least(&planned("cell.toml"), &post) > 0.0);
}

#[test]
fn a_scenario_of_another_cell_is_refused_in_one_line() {
    let refused = |folder: &TempDir, told: &[&str]| {
        let output = plan(folder, "cell.toml", "plan.toml");
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert_eq!(error.matches('\n').count(), 1, "{error}");
        assert!(error.contains("cell.toml") && told.iter().all(|t| error.contains(t)), "{error}");
        assert!(!folder.path().join("plan.toml").exists());
    };
    let without = CELL.replace("scenario = \"scenario.toml\"\n", "");
    refused(&folder(&without, |_| {}), &["scenario", "is missing", "name a scenario"]);
    let elsewhere = CELL.replace("scenario.toml", "nowhere.toml");
    refused(&folder(&elsewhere, |_| {}), &["cell.toml:3", "nowhere.toml is not there"]);
    refused(&folder(CELL, |d| d.balls[2].position.x += 0.0015), &["cell.toml:3", "ball '3' is 1.5 mm away"]);
    refused(&folder(CELL, |d| d.balls[1].id = "two".into()), &["cell.toml:3", "its balls are"]);
    refused(&folder(CELL, |d| d.payloads[0].name = "other".into()), &["cell.toml:3", "its payloads are"]);
    refused(&folder(CELL, |d| d.tool.xyz[2] += 0.002), &["cell.toml:3", "its tool is 2.0 mm"]);
    refused(&folder(CELL, |d| d.base.rz_ry_rx[0] += 0.01), &["cell.toml:3", "its tool is", "0.57 deg"]);
    // A difference within a millimetre is the same cell, measured better.
    let folder = folder(CELL, |d| d.balls[2].position.x += 0.0005);
    assert!(plan(&folder, "cell.toml", "plan.toml").status.success());
}

/// The guards of the example in the cell documentation.
#[test]
fn it_keeps_to_the_guards_of_the_cell() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/cell.md")).unwrap();
    let guards = page.lines().find(|line| line.starts_with("workspace_mm = ")).unwrap();
    let with_box =
        |guards: &str| CELL.replace("[[indicator]]\naxis = \"x\"", &format!("[guards]\n{guards}\n[[indicator]]\naxis = \"x\""));
    let rehearsed = |folder: &TempDir, plan: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
        let arguments = ["measure", "--cell", "cell.toml", "--plan", plan, "--dry-run", "--film", "page.html"];
        command.current_dir(folder.path()).args(arguments).output().unwrap()
    };
    let folder = folder(&with_box(guards), |_| {});
    // A plan made without the box is refused as a whole; that of the cell keeps to it and states its clearances.
    assert!(plan(&folder, "scenario.toml", "anywhere.toml").status.success());
    let refused = rehearsed(&folder, "anywhere.toml");
    let told = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(2) && told.contains("forbidden by the guards"), "{told}");
    let planned = plan(&folder, "cell.toml", "inside.toml");
    assert!(planned.status.success(), "{}", String::from_utf8_lossy(&planned.stderr));
    let allowed = rehearsed(&folder, "inside.toml");
    let said = String::from_utf8_lossy(&allowed.stdout).into_owned();
    assert!(allowed.status.success() && said.contains("the least clearance is"), "{said}");
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    let sentence = said.lines().find(|line| line.starts_with("the least clearance is")).unwrap();
    assert!(page.contains(sentence), "the page and the terminal say the same: {sentence}");
}
