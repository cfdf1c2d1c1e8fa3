//! `compensate` from the command line: fake targets with their KRL, URDF and robot file, exit codes, and one clear error for
//! bad input.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

use serde_json::Value;
use tempfile::TempDir;

const CELL: &str = include_str!("../../../scenarios/kr6-trical.toml");
const QUESTION: &str = include_str!("../../../scenarios/table8.toml");
const POSES: &str = "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\np-1,420,60,400,170,10,175\nlast,430,-80,380,-175,-5,180\n";
/// The second target is out of reach.
const HOLED: &str = "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\nnear,420,60,400,170,10,175\nfar,4500,60,400,170,10,175\n";
/// The positions of the first two targets, in metres.
const METRES: &str = "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\np-1,0.42,0.06,0.4,170,10,175\nlast,0.43,-0.08,0.38,-175,-5,180\n";
/// A tool in front of the flange, as the controller has it.
const TOOL: &str = "--tool=0,0,125,0,0,0";

pub fn calibench(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null()).output().expect("the program runs")
}

/// A folder with a run of a quick cell, created once.
pub fn run_folder() -> &'static Path {
    static RUN: OnceLock<TempDir> = OnceLock::new();
    let folder = RUN.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let quick = CELL.replace("pool_per_ball = 1000", "pool_per_ball = 100").replace("starts = 4", "starts = 1");
        let quick = quick.replace("validation_poses = 500", "validation_poses = 20");
        fs::write(folder.path().join("kr6-trical.toml"), quick).unwrap();
        fs::write(folder.path().join("s.toml"), QUESTION.split("[expect]").next().unwrap()).unwrap();
        let output = calibench(folder.path(), &["run", "s.toml", "--out", "r"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let told = String::from_utf8(output.stdout).unwrap();
        assert!(told.contains("compensated, by TriCal") && told.contains("as they are"), "{told}");
        folder
    });
    folder.path()
}

/// A new folder with the calibration and targets.
fn bench(targets: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(run_folder().join("r/trical.toml"), folder.path().join("c.toml")).unwrap();
    fs::write(folder.path().join("t.csv"), targets).unwrap();
    folder
}

fn text(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The second target lies in the foot of the robot, where the arm would drive its tool into itself.
#[test]
fn a_target_in_the_arm_itself_is_refused() {
    let folder = bench("id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\nnear,400,0,500,0,90,0\ninside,0,0,100,0,180,0\n");
    let told = calibench(folder.path(), &["compensate", "c.toml", "t.csv", "-o", "f.csv"]);
    assert_eq!(told.status.code(), Some(1), "{}", String::from_utf8_lossy(&told.stderr));
    let out = String::from_utf8(told.stdout).unwrap();
    assert!(out.contains("1 of 2 targets compensated") && out.contains("in the robot's own body: base"), "{out}");
    let file = text(&folder, "f.csv");
    let status: Vec<&str> = file.lines().map(|line| line.split(',').nth(1).unwrap()).collect();
    assert_eq!(status, ["status", "ok", "own_body"]);
}

#[test]
fn targets_become_a_csv_and_a_krl_module() {
    let folder = bench(POSES);
    let told = calibench(folder.path(), &["compensate", "c.toml", "t.csv", "-o", "f.csv", TOOL, "--krl", "Weld_1"]);
    assert_eq!(told.status.code(), Some(0), "{}", String::from_utf8_lossy(&told.stderr));
    let out = String::from_utf8(told.stdout).unwrap();
    assert!(out.contains("2 of 2 targets compensated") && out.contains("assumed: the flange carries 'heavy'"), "{out}");
    let file = text(&folder, "f.csv");
    let mut table = csv::Reader::from_reader(file.as_bytes());
    let header = table.headers().unwrap().clone();
    let of = |row: &csv::StringRecord, name: &str| row[header.iter().position(|h| h == name).unwrap()].to_owned();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let (src, dat) = (text(&folder, "Weld_1.src"), text(&folder, "Weld_1.dat"));
    for module in [&src, &dat] {
        assert!(
            module.split_terminator("\r\n").all(|line| !line.contains('\n')) && module.ends_with("\r\n"),
            "lines end as KUKA's"
        );
    }
    assert!(src.contains("DEF Weld_1 ( )\r\n") && dat.contains("DEFDAT Weld_1 PUBLIC\r\n"));
    assert!(src.contains("$BASE = {FRAME: X 0.0000,Y 0.0000,Z 0.0000,A 0.00000,B 0.00000,C 0.00000}"), "{src}");
    assert!(src.contains("$TOOL = {FRAME: X 0.0000,Y 0.0000,Z 125.0000,A 0.00000,B 0.00000,C 0.00000}"), "{src}");
    let moves: Vec<&str> = src.lines().filter(|line| line.starts_with("PTP {")).collect();
    assert_eq!(moves.len(), 2);
    let points: Vec<&str> = dat.lines().filter(|line| line.starts_with("DECL E6POS XP")).collect();
    for ((row, motion), point) in rows.iter().zip(moves).zip(points) {
        assert_eq!(of(row, "status"), "ok");
        assert!(motion.ends_with(&format!("; {}", of(row, "id"))), "{motion}");
        for i in 1..=6 {
            let degrees: f64 = of(row, &format!("q{i}_deg")).parse().unwrap();
            assert!(motion.contains(&format!("A{i} {degrees:.5}")), "{motion} against {degrees}");
        }
        let shift: f64 = of(row, "shift_mm").parse().unwrap();
        assert!(shift > 0.1 && shift < 20.0, "{shift}");
        let sigma: f64 = of(row, "sigma_3d_mm").parse().unwrap();
        assert!(sigma > 0.001 && sigma < 0.2, "{sigma}");
        let bits = format!(",S {},T {},E1 0.0,", of(row, "s"), of(row, "t"));
        assert!(point.contains(&bits), "{point} against {bits}");
        let x: f64 = of(row, "x_mm").parse().unwrap();
        assert!(point.contains(&format!("={{X {x:.4},Y ")), "{point} against {x}");
    }
    let straight =
        calibench(folder.path(), &["compensate", "c.toml", "t.csv", "-o", "f.csv", TOOL, "--krl", "Weld_1", "--lin"]);
    assert!(straight.status.success());
    let src = text(&folder, "Weld_1.src");
    assert_eq!(
        (src.matches("\r\nLIN {X ").count(), src.matches("\r\nPTP {A1 ").count()),
        (1, 1),
        "by joints to the first: {src}"
    );
}

#[test]
fn beyond_the_measured_ranges_no_error_is_promised() {
    let folder = bench("id,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\ninside,0,-90,90,0,45,0\nbeyond,0,-90,90,0,45,345\n");
    let output = calibench(folder.path(), &["compensate", "c.toml", "t.csv", "-o", "f.csv", TOOL]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("of the 1 in the measured ranges") && said.contains("No error can be predicted"), "{said}");
    let table = text(&folder, "f.csv");
    let mut rows = csv::Reader::from_reader(table.as_bytes());
    let place = rows.headers().unwrap().iter().position(|h| h == "sigma_3d_mm").unwrap();
    let sigma: Vec<String> = rows.records().map(|row| row.unwrap()[place].to_owned()).collect();
    assert!(sigma[0].parse::<f64>().is_ok() && sigma[1].is_empty(), "{sigma:?}");
    let output = calibench(folder.path(), &["compensate", "c.toml", "t.csv", "-o", "f.csv", TOOL, "--json"]);
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(document["targets"][1]["sigma_3d_mm"].is_null() && document["targets"][0]["sigma_3d_mm"].is_f64(), "{document}");
}

/// The set-up's TCP, (60, 0, -125) mm in the last MDH frame, is (-60, 0, 125) mm on KUKA's flange; its world is the base's
/// inverse.
#[test]
fn tool_and_world_of_the_set_up_are_told_as_the_controller_has_them() {
    let folder = bench("id,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\np1,0,-80,100,5,60,20\n");
    let told = calibench(folder.path(), &["compensate", "c.toml", "t.csv", "-o", "f.csv", "--base", "world", "--krl", "m"]);
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    let src = text(&folder, "m.src");
    assert!(src.contains("$TOOL = {FRAME: X -60.0000,Y 0.0000,Z 125.0000,"), "{src}");
    // The base is some 536 mm behind the world, 22 mm aside and 58 mm below, to a few millimetres.
    let base = src.lines().find(|line| line.starts_with("$BASE")).unwrap();
    let numbers: Vec<f64> = base.split([' ', ',', '}']).filter_map(|word| word.parse().ok()).collect();
    for (number, about) in numbers.iter().zip([536.0, 22.0, 58.0, 0.0, 0.0, 0.0]) {
        assert!((number - about).abs() < 5.0, "{base}");
    }
}

/// The commands in the documentation run as printed.
#[test]
fn the_page_tells_what_works() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(root.join("docs/compensation.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("runs")).unwrap();
    std::os::unix::fs::symlink(root.join("scenarios"), folder.path().join("scenarios")).unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_calibench"));
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
    let mut told = Vec::new();
    for block in page.split("```sh\n").skip(1).map(|b| b.split("```").next().unwrap()) {
        let shell = ["-euo", "pipefail", "-c", block];
        let output = Command::new("bash").args(shell).current_dir(&folder).env("PATH", &path).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{block}: {}", String::from_utf8_lossy(&output.stderr));
        told.push(String::from_utf8(output.stdout).unwrap());
    }
    let row = |name: &str| -> f64 {
        let line = told[0].lines().rfind(|line| line.contains(name)).unwrap();
        line.split(['│', '┆']).nth(2).unwrap().trim().parse().unwrap()
    };
    let said = format!("from {:.1} mm to {:.2} mm in the mean", row("as they are"), row("compensated, by TriCal"));
    assert!(page.replace('\n', " ").contains(&said), "the page does not say: {said}");
    for made in ["runs/fake.csv", "Weld_1.src", "Weld_1.dat", "runs/calibrated.urdf", "runs/calibrated.toml"] {
        let beside = folder.path().join("runs").join(made);
        assert!(folder.path().join(made).is_file() || beside.is_file(), "{made}");
    }
}

#[test]
fn a_refused_target_keeps_its_row_and_ends_with_code_1() {
    let folder = bench(HOLED);
    let told = calibench(folder.path(), &["compensate", "c.toml", "t.csv", "-o", "f.csv", TOOL, "--krl", "m"]);
    assert_eq!(told.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&told.stdout).contains("1 of 2 targets compensated"));
    assert!(String::from_utf8_lossy(&told.stderr).contains("no KRL module was written"));
    let file = text(&folder, "f.csv");
    assert!(file.contains("\nnear,ok,") && file.contains("\nfar,unreachable,"), "{file}");
    assert!(!folder.path().join("m.src").exists() && !folder.path().join("m.dat").exists());
    let json = calibench(folder.path(), &["compensate", "c.toml", "t.csv", "-o", "f.csv", TOOL, "--json"]);
    assert_eq!(json.status.code(), Some(1));
    let document: Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!((&document["format"], &document["compensated"]), (&"calibench-compensation/1".into(), &1.into()));
    assert_eq!(document["targets"][1]["status"], "unreachable");
}

/// The identified arm is an ordinary robot: a dataset may refer to it, and less remains to be identified.
#[test]
fn a_dataset_may_name_the_calibrated_robot() {
    let folder = bench(POSES);
    let told = calibench(folder.path(), &["compensate", "c.toml", "--urdf", "robot.urdf", "--mdh", "calibrated.toml"]);
    assert_eq!(told.status.code(), Some(0), "{}", String::from_utf8_lossy(&told.stderr));
    assert!(text(&folder, "robot.urdf").contains("NOT IN THIS FILE"));
    let dataset = folder.path().join("d");
    fs::create_dir(&dataset).unwrap();
    for name in ["dataset.toml", "samples.csv"] {
        fs::copy(run_folder().join("r/trical").join(name), dataset.join(name)).unwrap();
    }
    fs::copy(folder.path().join("calibrated.toml"), dataset.join("calibrated.toml")).unwrap();
    fs::write(folder.path().join("m.toml"), "effects = [\"base_frame\", \"joint_compliance\"]\n").unwrap();
    let rms = |robot: &str| -> f64 {
        let path = dataset.join("dataset.toml");
        let described = fs::read_to_string(run_folder().join("r/trical/dataset.toml")).unwrap();
        assert!(described.contains("robot = \"kr6_r700\""));
        fs::write(&path, described.replace("robot = \"kr6_r700\"", &format!("robot = \"{robot}\""))).unwrap();
        let told = calibench(folder.path(), &["identify", "d", "--model", "m.toml", "-o", "again.toml", "--json"]);
        assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
        let written = text(&folder, "again.toml");
        let line = written.lines().find(|l| l.starts_with("rms_mm")).unwrap();
        line.split('=').nth(1).unwrap().trim().parse().unwrap()
    };
    let (drawn, calibrated) = (rms("kr6_r700"), rms("calibrated.toml"));
    assert!(calibrated < 0.1 * drawn, "{calibrated} mm against {drawn} mm as drawn: the links are already right");
}

#[test]
fn bad_input_ends_in_one_clear_error() {
    let compensate = ["compensate", "c.toml", "t.csv", "-o", "f.csv"];
    let with = |more: &[&str]| [&compensate[..], more].concat().into_iter().map(str::to_owned).collect::<Vec<_>>();
    // Targets, arguments, contents of the error line.
    let cases: Vec<(String, Vec<String>, &[&str])> = vec![
        (POSES.replace("420", "x"), with(&[]), &["t.csv:2: x_mm", "not a number"]),
        (POSES.into(), with(&["--krl", "1st"]), &["1st", "begin with a letter"]),
        (POSES.into(), with(&["--krl", "weld-1"]), &["weld-1", "letters, digits"]),
        (POSES.into(), with(&["--krl", "a_name_of_more_than_24_letters"]), &["too long"]),
        (POSES.into(), with(&["--krl", "end"]), &["word of the language"]),
        (POSES.into(), with(&["--lin"]), &["--krl"]),
        (POSES.into(), with(&["--base", "1,2,3"]), &["--base", "6 numbers", "world"]),
        (POSES.into(), with(&["--tool", "1,2,3,4,5,nan"]), &["--tool", "6 numbers"]),
        (POSES.into(), with(&["--load", "6000,0,0,0"]), &["--load", "no arm carries"]),
        (POSES.into(), with(&["--tool", "1e6,0,0,0,0,0"]), &["--tool", "as in no cell"]),
        (POSES.into(), with(&["--base", "1e9,0,0,0,0,0"]), &["--base", "as in no cell"]),
        (METRES.into(), with(&[]), &["t.csv: x_mm", "metres", "in mm"]),
        (POSES.into(), with(&["--load=-1,0,0,0"]), &["--load", "a mass is not negative"]),
        (POSES.into(), with(&["--session", "monday"]), &["c.toml", "no set-up 'monday'"]),
        (
            POSES.replace("id,", "id,payload,").replace("p-1,", "p-1,lead,").replace("last,", "last,,"),
            with(&[]),
            &["t.csv:2: payload", "heavy"],
        ),
        (POSES.into(), vec!["compensate".into(), "c.toml".into()], &["nothing to do", "--urdf"]),
        (POSES.into(), ["compensate", "c.toml", "t.csv"].map(str::to_owned).to_vec(), &["--out"]),
        (
            POSES.into(),
            ["compensate", "nosuch.toml", "t.csv", "-o", "f.csv"].map(str::to_owned).to_vec(),
            &["nosuch.toml", "cannot be read"],
        ),
        (
            POSES.into(),
            ["compensate", "c.toml", "nosuch.csv", "-o", "f.csv"].map(str::to_owned).to_vec(),
            &["nosuch.csv", "cannot be read"],
        ),
    ];
    for (targets, arguments, named) in cases {
        let folder = bench(&targets);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let output = calibench(folder.path(), &arguments);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert!(output.stdout.is_empty() && error.matches('\n').count() == 1, "{arguments:?}: {error}");
        assert!(error.starts_with("calibench: ") && error.contains("; "), "{arguments:?}: {error}");
        assert!(named.iter().all(|name| error.contains(name)), "{arguments:?}: {error}");
        assert!(!folder.path().join("f.csv").exists(), "{arguments:?} left a file");
    }
}
