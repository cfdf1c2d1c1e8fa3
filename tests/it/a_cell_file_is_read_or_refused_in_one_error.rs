//! `cell.toml` is read as its guide says, and every mistake in it ends in one error that names the line, the key and the remedy.

use std::path::{Path, PathBuf};

use calibench::cell::gauge::Place;
use calibench::cell::gauge::{Dialect, LineSettings};
use calibench::cell::kuka::{Actions, Fitness, KukaSettings, RobotProgram, Variables};
use calibench::cell::patience::Patience;
use calibench::cell::{RobotSettings, TriCal};
use calibench::files::FileError;
use calibench::measure::campaign::cell::{Cell, read_cell};
use calibench::measure::campaign::mastering::MasteringSettings;
use calibench::measure::centring::CentringSettings;
use calibench::measure::poses::ProbingPlan;
use calibench::measure::poses::ways::HomeWays;
use calibench::measure::session::{FirstMotion, StartError};
use calibench::robot::solids::Shape;
use calibench::units::{DEG, MM};

const DATASET: &str = "format = \"calibench-dataset/1\"\nrobot = \"kr6_r700\"\nbase = { x_mm = 0, y_mm = 0, z_mm = 0 }\n\
    tool = { x_mm = 60, y_mm = 0, z_mm = -125 }\n";

/// Thirteen lines; what follows stands in the last table.
const SHORT: &str = "format = \"calibench-cell/1\"
dataset = \"dataset.toml\"
[robot]
address = \"192.168.1.10:7000\"
[[indicator]]
axis = \"z\"
port = \"/dev/ttyUSB2\"
[[indicator]]
axis = \"x\"
port = \"/dev/ttyUSB0\"
[[indicator]]
axis = \"y\"
address = \"localhost:5002\"
";

fn read(text: &str) -> Result<Cell, FileError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("dataset.toml"), DATASET).unwrap();
    let path = folder.path().join("cell.toml");
    std::fs::write(&path, text).unwrap();
    read_cell(&path)
}

fn kuka(cell: &Cell) -> &KukaSettings {
    match &cell.robot {
        RobotSettings::Kuka(settings) => settings,
        other => panic!("not a KUKA: {other:?}"),
    }
}

#[test]
fn what_is_not_said_has_its_default() {
    let cell = read(SHORT).unwrap();
    assert_eq!(kuka(&cell).joints, 6);
    assert_eq!(kuka(&cell).program, RobotProgram::Calibench);
    assert_eq!((&kuka(&cell).variables, &kuka(&cell).actions), (&Variables::default(), &Actions::default()));
    assert_eq!((&kuka(&cell).fitness, &kuka(&cell).patience), (&Fitness::default(), &Patience::default()));
    assert_eq!(cell.speed_percent, 10);
    assert_eq!(cell.indicators.as_ref().unwrap()[0].place, Place::Serial("/dev/ttyUSB0".into(), LineSettings::OPTO_RS));
    assert_eq!(cell.indicators.as_ref().unwrap()[1].place, Place::Socket("localhost:5002".into()));
    assert_eq!(cell.indicators.as_ref().unwrap()[2].settings.dialect, Dialect::SYLVAC);
    assert!((cell.guards.max_step - TriCal::PAPER.safe_range).abs() < 1e-12);
    assert!(cell.guards.workspace.is_none());
    assert_eq!(cell.mastering, MasteringSettings::default());
    let CentringSettings { max_step, tolerance, .. } = CentringSettings::default();
    assert_eq!(
        cell.centring,
        CentringSettings {
            max_step: cell.centring.max_step,
            tolerance: cell.centring.tolerance,
            ..CentringSettings::default()
        }
    );
    assert!((cell.centring.max_step - max_step).abs() < 1e-12 && (cell.centring.tolerance - tolerance).abs() < 1e-15);
    assert!((cell.trical.master_reading() - 6.35 * MM).abs() < 1e-9);
}

#[test]
fn what_is_said_is_taken() {
    let text = SHORT.replace(
        "address = \"192.168.1.10:7000\"\n",
        "address = \"robot:7001\"\nprogram = \"plain\"\nspeed_percent = 30\nflange.b_deg = 180\nactions.line = 12\n\
         variables = { joints = \"$AXIS_ACT_MEAS\", commanded = \"$AXIS_ACT\", order = \"\" }\n\
         fitness.modes = [\"T1\"]\npatience = { answer_s = 0.5, poll_ms = 20 }\n",
    ) + "dialect = \"mahr\"\ncounts_down = true\ntimeout_s = 1\n[guards]\nmax_step_mm = 2\nworkspace_mm = [[0, 0, 0], [1, 2, 3]]\n\
         [trical]\nmaster_diameter_mm = 40.0\n[centring]\ntolerance_um = 5\n";
    let cell = read(&text).unwrap();
    assert_eq!((kuka(&cell).program, kuka(&cell).actions.line, kuka(&cell).actions.joints), (RobotProgram::Plain, 12, 2));
    assert_eq!(kuka(&cell).variables.joints, "$AXIS_ACT_MEAS");
    assert_eq!(kuka(&cell).fitness.modes, ["T1"]);
    assert_eq!(kuka(&cell).patience.poll.as_millis(), 20);
    assert_eq!(cell.last_frame_from_flange.rz_ry_rx[1], 180.0 * DEG);
    assert!(cell.indicators.as_ref().unwrap()[1].settings.counts_down);
    assert_eq!(cell.indicators.as_ref().unwrap()[1].settings.dialect, Dialect::MAHR);
    assert_eq!(cell.guards.workspace.unwrap()[1].z, 3.0 * MM);
    assert_eq!(cell.centring.max_step, cell.guards.max_step);
    // The tool points the other way in a flange that is turned by half a turn about y.
    let tool = cell.flange_from_tool();
    assert!((tool.xyz[0] + 60.0 * MM).abs() < 1e-12 && (tool.xyz[2] - 125.0 * MM).abs() < 1e-12);
}

#[test]
fn a_robot_may_say_its_kind() {
    let named = read(&SHORT.replace("[robot]\n", "[robot]\nkind = \"kuka\"\n")).unwrap();
    assert_eq!(named.robot, read(SHORT).unwrap().robot);
}

#[test]
fn each_mistake_is_one_error_with_its_place_and_remedy() {
    let cases: &[(&str, &str, Option<usize>, &str, &str)] = &[
        ("calibench-cell/1", "calibench-cell/2", Some(1), "format", "calibench-cell/1"),
        ("dataset.toml", "elsewhere.toml", Some(2), "dataset", "relative"),
        ("192.168.1.10:7000", "192.168.1.10", Some(4), "robot.address", "HOST:PORT"),
        ("192.168.1.10:7000", "192.168.1.10:70000", Some(4), "robot.address", "HOST:PORT"),
        ("192.168.1.10:7000", "http://192.168.1.10:7000", Some(4), "robot.address", "HOST:PORT"),
        ("[robot]\n", "[robot]\nmotion.joint_speed_deg_s = 30\n", Some(3), "robot", "kind = \"ur\""),
        ("[robot]\n", "[robot]\nmotion.joint_speed = 30\n", Some(4), "robot.motion", "known here"),
        ("[robot]\n", "[robot]\npatience.reconnects = 1000\n", Some(4), "robot.patience.reconnects", "0 to 100"),
        ("[robot]\n", "[robot]\nspeed_percent = 101\n", Some(4), "robot.speed_percent", "1 to 100"),
        ("[robot]\n", "[robot]\nkind = \"kuku\"\n", Some(4), "robot.kind", "`kuka`"),
        ("[robot]\n", "[robot]\nspeed = 10\n", Some(4), "robot.speed", "speed_percent"),
        ("[robot]\n", "[robot]\nprogram = \"robodk\"\n", Some(4), "robot.program", "plain"),
        ("[robot]\n", "[robot]\nvariables.joints = \"\"\n", Some(4), "robot.variables.joints", "name one"),
        ("[robot]\n", "[robot]\nvariables.done = \"A B\"\n", Some(4), "robot.variables.done", "name one"),
        ("[robot]\n", "[robot]\nvariables.axes = \"$A\"\n", Some(4), "robot.variables.axes", "known here"),
        ("[robot]\n", "[robot]\npatience.answer_s = 0\n", Some(4), "robot.patience.answer_s", "positive"),
        ("[robot]\n", "[robot]\npatience.motion_s = 1e9\n", Some(4), "robot.patience.motion_s", "less than a day"),
        ("axis = \"z\"", "axis = \"x\"", Some(9), "indicator[1].axis", "each of x, y, z"),
        ("axis = \"z\"", "axis = \"w\"", Some(6), "indicator[0].axis", "did you mean"),
        ("port = \"/dev/ttyUSB2\"\n", "", Some(5), "indicator[0]", "either `port`"),
        ("port = \"/dev/ttyUSB2\"\n", "port = \"a\"\naddress = \"b:1\"\n", Some(5), "indicator[0]", "either `port`"),
        ("localhost:5002", "localhost", Some(13), "indicator[2].address", "HOST:PORT"),
        ("port = \"/dev/ttyUSB2\"\n", "port = \"a\"\nline = \"4800 7E3\"\n", Some(8), "indicator[0].line", "4800 7E2"),
        ("port = \"/dev/ttyUSB2\"\n", "port = \"a\"\ndialect = \"silvac\"\n", Some(8), "indicator[0].dialect", "`sylvac`"),
        ("port = \"/dev/ttyUSB2\"\n", "port = \"a\"\ntimeout_s = -1.0\n", Some(8), "indicator[0].timeout_s", "positive"),
        ("[robot]\n", "[guards]\nmax_step_mm = 6\n[robot]\n", Some(4), "guards.max_step_mm", "5 or less"),
        ("[robot]\n", "[guards]\nmax_step_mm = nan\n[robot]\n", Some(4), "guards.max_step_mm", "finite"),
        ("[robot]\n", "[guards]\njoint_margin_deg = -1\n[robot]\n", Some(4), "guards.joint_margin_deg", "zero or more"),
        (
            "[robot]\n",
            "[guards]\nworkspace_mm = [[0, 0, 0], [1, 0, 1]]\n[robot]\n",
            Some(4),
            "guards.workspace_mm",
            "lower corner",
        ),
        ("[robot]\n", "[trical]\nmaster_diameter_mm = 20\n[robot]\n", Some(4), "trical.master_diameter_mm", "larger"),
        ("[robot]\n", "[centring]\ntolerance_um = 0\n[robot]\n", Some(4), "centring.tolerance_um", "positive"),
    ];
    for (from, to, line, field, remedy) in cases {
        assert!(SHORT.contains(from), "{from}");
        let text = SHORT.replacen(from, to, 1);
        let error = read(&text).expect_err(to);
        assert_eq!((error.line, error.field.as_str()), (*line, *field), "{to}: {error}");
        assert!(error.remedy.contains(remedy), "{to}: {error}");
        assert_eq!(error.to_string().lines().count(), 1);
    }
    let two = SHORT.split_at(SHORT.rfind("[[indicator]]").unwrap()).0;
    assert!(read(two).unwrap_err().remedy.contains("three"));
}

#[test]
fn a_mistake_in_the_dataset_is_told_of_the_dataset() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("dataset.toml"), DATASET.replace("kr6_r700", "kr6")).unwrap();
    let path: PathBuf = folder.path().join("cell.toml");
    std::fs::write(&path, SHORT).unwrap();
    let error = read_cell(Path::new(&path)).unwrap_err();
    assert!(error.path.ends_with("dataset.toml") && error.field == "robot", "{error}");
    // A controller of six axes does not move seven.
    std::fs::write(folder.path().join("dataset.toml"), DATASET.replace("kr6_r700", "panda")).unwrap();
    assert_eq!(read_cell(&path).unwrap_err().field, "dataset");
}

/// A cell with a ball and a scene, and a plan that has a home and no pose.
fn beside_a_table(cell: &str, scene: &str) -> (tempfile::TempDir, Result<Cell, FileError>) {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("dataset.toml", &format!("{DATASET}[[ball]]\nid = \"1\"\nx_mm = 500\ny_mm = 0\nz_mm = 50\n"));
    write("scene.toml", &format!("format = \"calibench-scene/1\"\n{scene}"));
    write("cell.toml", cell);
    let cell = read_cell(&folder.path().join("cell.toml"));
    (folder, cell)
}

const TABLE: &str = "[[solid]]\nname = \"table\"\nmin_mm = [-900, -900, -100]\nmax_mm = [900, 900, -60]\n";

fn with_scene(rest: &str) -> String {
    SHORT.replace("[robot]", &format!("[surroundings]\n{rest}\n[robot]"))
}

#[test]
fn the_bodies_around_the_arm_are_those_of_the_scene_and_the_balls() {
    let small = with_scene("scene = \"scene.toml\"") + "[trical]\ndatum_diameter_mm = 20\nmaster_diameter_mm = 38.1\n";
    let (_folder, cell) = beside_a_table(&small, TABLE);
    let bodies = cell.unwrap().surroundings.unwrap();
    assert_eq!(bodies.fixed.iter().map(|body| body.name.as_str()).collect::<Vec<_>>(), ["table", "ball 1"]);
    match &bodies.fixed[1].shape {
        Shape::Capsule { ends: [from, to], radius } => {
            assert!(from == to && (from.x - 500.0 * MM).abs() < 1e-12 && (radius - 10.0 * MM).abs() < 1e-12)
        }
        other => panic!("{other:?}"),
    }
    assert!(beside_a_table(SHORT, TABLE).1.unwrap().surroundings.is_none());
}

#[test]
fn a_mistake_in_the_surroundings_is_one_error_with_its_place_and_remedy() {
    let refused = |cell: &str, scene: &str, told: &[&str]| {
        let error = beside_a_table(cell, scene).1.unwrap_err().to_string();
        assert!(told.iter().all(|part| error.contains(part)), "{error}");
    };
    refused(&with_scene(""), TABLE, &["cell.toml:3", "surroundings", "scene"]);
    refused(
        &with_scene("scene = \"nowhere.toml\""),
        TABLE,
        &["cell.toml:4", "surroundings.scene", "nowhere.toml is not there"],
    );
    refused(&with_scene("scene = \"scene.toml\"\nsolid = 1"), TABLE, &["cell.toml:5", "surroundings.solid"]);
    let named = with_scene("scene = \"scene.toml\"");
    refused(&named, &TABLE.replace("min_mm", "least_mm"), &["scene.toml:4", "min_mm"]);
    refused(&named, &TABLE.replace("\"table\"", "\"ball 1\""), &["cell.toml:4", "'ball 1'", "leave the balls out"]);
}

#[test]
fn off_all_motions_of_its_plan_the_arm_goes_home_among_known_bodies_alone() {
    let plan = ProbingPlan {
        ways: Some(HomeWays { home: [0.0, -90.0, 90.0, 0.0, 10.0, 0.0].map(|q| q * DEG).to_vec(), ..HomeWays::default() }),
        ..ProbingPlan::default()
    };
    let at = [60.0, -60.0, 90.0, 0.0, 40.0, 0.0].map(|q| q * DEG);
    let found = |cell: &str, scene: &str| FirstMotion::from(&beside_a_table(cell, scene).1.unwrap(), &plan, &at);
    let told = |found: Result<FirstMotion, StartError>| found.map(|motion| motion.words).unwrap_err().to_string();
    let named = with_scene("scene = \"scene.toml\"");
    assert!(found(&named, TABLE).unwrap().words.unwrap().contains("it first goes to the home posture"));
    let boxed = format!("{TABLE}[[solid]]\nname = \"cage\"\nmin_mm = [-900, -900, -100]\nmax_mm = [900, 900, 900]\n");
    assert!(told(found(&named, &boxed)).contains("jog it to the home posture"));
    let error = found(SHORT, TABLE).map(|motion| motion.words).unwrap_err();
    assert!(error.is_of_the_request());
    let told = error.to_string();
    assert!(
        ["cell.toml", "surroundings.scene: is missing", "name a scene.toml", "-90.0"].iter().all(|part| told.contains(part)),
        "{told}"
    );
}

/// The example of the guide.
#[test]
fn the_guide_s_example_is_read() {
    let guide = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cell.md")).unwrap();
    let example = guide.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let (_folder, cell) = beside_a_table(&example.replace("cell/dataset.toml", "dataset.toml"), TABLE);
    let cell = cell.unwrap();
    assert!(cell.surroundings.is_some());
    assert_eq!(cell.last_frame_from_flange.rz_ry_rx[1], 180.0 * DEG);
    assert!(cell.guards.workspace.is_some());
}
