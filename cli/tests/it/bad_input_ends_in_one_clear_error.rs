//! Any error in a scenario, a dataset, a flag or a path gives exit code 2, one line on standard error that names file, line,
//! key and remedy, and nothing on standard output; existing output is left unchanged.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use calibench::robot::built_in;
use calibench::robot::robot_file::to_toml;
use calibench_sim::scenario::load_scenario;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

const CELL: &str = include_str!("../../../scenarios/kr6-trical.toml");
const QUESTION: &str = include_str!("../../../scenarios/table8.toml");
/// Output path of the program in every test.
const OUT: &str = "out put";

fn calibench(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).args(arguments).env("RUST_BACKTRACE", "1").stdin(Stdio::null());
    command.output().expect("the program runs")
}

/// A folder with a cell that is quick to plan, and a scenario that extends it.
fn good() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let quick = CELL.replace("pool_per_ball = 1000", "pool_per_ball = 100").replace("starts = 4", "starts = 1");
    let quick = quick.replace("validation_poses = 500", "validation_poses = 20");
    fs::write(folder.path().join("kr6-trical.toml"), quick).expect("writable");
    let question = QUESTION.split("[expect]").next().unwrap_or_default();
    fs::write(folder.path().join("s.toml"), question).expect("writable");
    folder
}

fn line_of(path: &Path, text: &str) -> usize {
    let content = fs::read_to_string(path).expect("a text");
    1 + content.lines().position(|l| l.contains(text)).unwrap_or_else(|| panic!("{} has no {text:?}", path.display()))
}

fn replace(path: &Path, old: &str, new: &str) {
    let text = fs::read_to_string(path).expect("a text");
    assert!(text.contains(old), "{} has no {old:?}", path.display());
    fs::write(path, text.replacen(old, new, 1)).expect("writable");
}

/// The single line of a refusal; panics if there is anything else.
fn refusal(what: &str, output: &Output) -> String {
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{what}: {error}");
    assert!(output.stdout.is_empty(), "{what}: {}", String::from_utf8_lossy(&output.stdout));
    assert_eq!(error.matches('\n').count(), 1, "{what}: {error}");
    assert!(error.starts_with("calibench: ") && error.ends_with('\n') && error.contains("; "), "{what}: {error}");
    error
}

/// A mistake and the expected error.
struct Mistake {
    /// The cell's file, or the scenario's own.
    file: &'static str,
    old: &'static str,
    new: &'static str,
    /// Text on the line to be named, after the change.
    on: Option<&'static str>,
    field: &'static str,
    remedy: &'static str,
}

fn cell(old: &'static str, new: &'static str, field: &'static str, remedy: &'static str) -> Mistake {
    Mistake { file: "kr6-trical.toml", old, new, on: Some(new), field, remedy }
}

fn own(old: &'static str, new: &'static str, field: &'static str, remedy: &'static str) -> Mistake {
    Mistake { file: "s.toml", ..cell(old, new, field, remedy) }
}

/// Mistakes found when the scenario is read.
fn mistakes() -> Vec<Mistake> {
    vec![
        own("scenario/1", "scenario/2", "format", "calibench-scenario/1"),
        own("seed = 1", "seed = -1", "seed", "not negative"),
        own("seed = 1", "seed = 99999999999999999999", "seed", "2^63"),
        own("seed = 1", "sed = 1", "sed", "did you mean `seed`"),
        own("kr6-trical.toml", "nosuch.toml", "extends", "existing"),
        own("kr6-trical.toml", "s.toml", "extends", "does not lead back"),
        own("extends = \"kr6-trical.toml\"", "extends = 3", "extends", "in quotes"),
        Mistake { on: None, ..own("extends = \"kr6-trical.toml\"", "", "", "add") },
        own("effects.mdh]", "effects.mhd]", "truth.effects.mhd", "correct its name"),
        own("a1_mm = 0.243", "a1_um = 243.0", "truth.effects.mdh.a1_um", "a1_mm"),
        own("a1_mm = 0.243", "a1_mm = 1e300", "truth.effects.mdh.a1_mm", "unit"),
        own("a1_mm = 0.243", "a1_mm = inf", "truth.effects.mdh.a1_mm", "finite"),
        own("seed = 1", "seed = 1\nexpect = { drift = [0, 1] }", "expect.drift", "trical_mean_mm"),
        own("seed = 1", "seed = 1\nexpect = { rank = [2, 1] }", "expect.rank", "trical_mean_mm"),
        Mistake { on: Some("gravity_m_s2"), ..cell("[0.0, 0.0, -9.81]", "[0.0, nan, -9.81]", "gravity_m_s2[1]", "finite") },
        cell("\"kr6_r700\"", "\"kr5\"", "robot", "built-in"),
        Mistake { on: Some("joint_arcsec = [1.4"), ..cell("\"kr6_r700\"", "\"panda\"", "noise.joint_arcsec", "7 joints") },
        cell("x_mm = 60.0", "x = 60.0", "tool.x", "the unit is part of the name"),
        cell("x_mm = 60.0", "x_m = 0.06", "tool.x_m", "as `x_mm`"),
        cell("x_mm = 60.0", "x_mm = \"60\"", "tool.x_mm", "a number"),
        cell("x_mm = 60.0", "x_mm = nan", "tool.x_mm", "finite"),
        Mistake { on: Some("[tool]"), ..cell("x_mm = 60.0", "", "tool.x_mm", "add `x_mm`") },
        cell("sigma_um = 2.3", "sigma_um = -2.3", "tool.sigma_um", "zero or"),
        cell("mass_kg = 6.0", "mass_kg = -6.0", "payload[0].mass_kg", "zero or"),
        cell("preload_n = 0.65", "preload_n = -0.65", "indicators.preload_n", "zero or"),
        cell("preload_n = 0.65", "preload_n = 1e4", "indicators.preload_n", "from 0 to 100"),
        cell("id = \"2\"", "id = \"1\" # twice", "ball[1].id", "its own name"),
        cell("id = \"2\"", "id = \"\\u001b[31m\\n\"", "ball[1].id", "plain name"),
        cell("id = \"2\"", "id = \"\"", "ball[1].id", "plain name"),
        cell("sigma_um = 2.0", "sigma_um = -2.0", "ball[0].sigma_um", "zero or"),
        cell("outward = [0.0, 0.0, 1.0]", "outward = [0, 0, 0]", "ball[0].outward", "stem"),
        cell("ball_um = 1.0", "ball_um = 0.0", "noise.ball_um", "positive"),
        cell("[1.4, 1.4, 1.9, 2.9, 4.1, 4.1]   #", "[1.4, 1.9, 2.9, 4.1, 4.1] #", "noise.joint_arcsec", "6 joints"),
        cell("lost_motion_arcsec = [1.4", "lost_motion_arcsec = [-1.4", "lost_motion_arcsec[0]", "zero or"),
        Mistake { on: Some("[[solid]]"), ..cell("min_mm = [-900.0", "min_mm = [900.0", "solid[0]", "min_mm below max_mm") },
        Mistake {
            on: Some("[[carried]]"),
            ..cell("radius_mm = 30.0", "radius_mm = -30.0", "carried[0]", "positive radius_mm")
        },
        cell("poses_per_ball = 20", "poses_per_ball = 0", "plan.poses_per_ball", "from 1"),
        cell("pool_per_ball = 100", "pool_per_ball = 10", "plan.pool_per_ball", "from 2"),
        cell("pool_per_ball = 100", "pool_per_ball = 1000000000", "plan.pool_per_ball", "to 25000"),
        cell("starts = 1", "starts = 1000000", "plan.starts", "to 100"),
        cell("identification_poses = 80", "identification_poses = 4000000", "tracker.identification_poses", "to 2000"),
        cell("validation_poses = 20", "validation_poses = 0", "tracker.validation_poses", "from 1"),
        cell("validation_poses = 20", "validation_poses = 500000000", "tracker.validation_poses", "to 20000"),
        cell("cone_deg = 70.0", "cone_deg = 1e6", "plan.cone_deg", "180"),
        cell("facing_deg = 30.0", "facing_deg = -30.0", "tracker.facing_deg", "zero or"),
        cell("\"interleaved\"", "\"sideways\"", "plan.order", "ball-by-ball"),
        cell("tolerance_um = 3.0", "tolerance_um = 0.0", "centring.tolerance_um", "3 µm"),
        cell("tolerance_um = 3.0", "tolerance_um = 1e6", "centring.tolerance_um", "12500"),
        cell("\"mdh\",", "\"phlogiston\",", "model.effects[1]", "catalogue"),
        cell("\"mdh\",", "\"base_frame\",", "model.effects[1]", "keep one"),
        cell("[\"base_frame\", \"mdh\", \"joint_compliance\"]", "[]", "model.effects", "at least one"),
        cell("drop_out = 0.0", "drop_out = 1.5", "truth.indicators.drop_out", "0 to 1"),
        cell("tilt_mrad = 1.0", "tilt_mrad = -1.0", "truth.indicators.tilt_mrad", "zero or"),
        cell(
            "encoder_resolution_deg = 1e-5",
            "encoder_resolution_deg = -1",
            "truth.controller.encoder_resolution_deg",
            "zero or",
        ),
        cell("speed_deg_per_s = 60.0", "speed_deg_per_s = 1e-300", "truth.controller.speed_deg_per_s", "0.001"),
        cell("nest_shots = 100", "nest_shots = 0", "truth.tracker.nest_shots", ""),
        cell("[centring]", "[centering]", "centering", "did you mean `centring`"),
    ]
}

/// Mistakes found only by planning or measuring.
fn impossible_cells() -> Vec<Mistake> {
    let at = |on: &'static str, m: Mistake| Mistake { on: Some(on), ..m };
    vec![
        at("[[ball]]", cell("x_mm = -79.539\n", "x_mm = 5000.0\n", "ball[0]", "move the ball")),
        at("[[ball]]", cell("z_mm = 17.531", "z_mm = -100.0", "ball[0]", "move the ball")),
        cell("x_mm = -536.320", "x_mm = -53632.0", "base.x_mm", "millimetres"),
        at("[[ball]]", cell("clearance_mm = 3.0", "clearance_mm = 5000.0", "ball[0]", "clearance_mm")),
        cell("poses_per_ball = 20", "poses_per_ball = 2", "plan.poses_per_ball", "number of poses"),
        at("[tracker]", cell("facing_deg = 30.0", "facing_deg = 1.0", "tracker", "facing_deg")),
        at("[truth.indicators]", cell("drop_out = 0.0", "drop_out = 1.0", "truth.indicators", "smaller")),
        Mistake {
            file: "s.toml",
            ..at(
                "[truth",
                cell(
                    "preload_n = 0.65\nfull_force_n = 0.90\ndrop",
                    "preload_n = 1e4\nfull_force_n = 0.90\ndrop",
                    "truth",
                    "smaller",
                ),
            )
        },
        cell("[-79.65, -60.0, 240.0]]", "[0.0, -100.0, 0.0]]", "tracker.nests_mm", "spread"),
        Mistake { on: Some("[truth"), ..own("c6_mdeg_per_nm = 28.161", "c6_mdeg_per_nm = 1e4", "truth", "smaller") },
    ]
}

/// Makes a mistake in a good folder; returns the file and the line to be named.
fn make(mistake: &Mistake, folder: &Path) -> (PathBuf, Option<usize>) {
    // In some cases the mistake is in one file and the error is reported in another.
    let changed = if fs::read_to_string(folder.join(mistake.file)).expect("a text").contains(mistake.old) {
        mistake.file
    } else {
        "kr6-trical.toml"
    };
    replace(&folder.join(changed), mistake.old, mistake.new);
    let path = folder.join(mistake.file);
    let line = mistake.on.map(|on| line_of(&path, on.lines().last().unwrap_or_default()));
    (path, line)
}

#[test]
fn a_mistake_in_a_scenario_is_named_by_the_library() {
    assert!(load_scenario(&good().path().join("s.toml")).is_ok());
    let mut wrong = Vec::new();
    for mistake in mistakes() {
        let folder = good();
        let (path, line) = make(&mistake, folder.path());
        let what = format!("{} for {}", mistake.new, mistake.old);
        let error = load_scenario(&folder.path().join("s.toml")).err().unwrap_or_else(|| panic!("{what}: was accepted"));
        let placed = mistake.on.is_none() || (&error.path, error.line) == (&path, line);
        if !placed || !error.field.contains(mistake.field) || !error.remedy.contains(mistake.remedy) {
            wrong.push(format!("{what}: not line {line:?}, {:?}, {:?}: {error}", mistake.field, mistake.remedy));
        }
        assert!(!error.to_string().chars().any(char::is_control), "{what}: {error:?}");
    }
    assert!(wrong.is_empty(), "{} of the mistakes:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn a_mistake_in_a_scenario_ends_every_verb_alike() {
    for (k, mistake) in mistakes().iter().enumerate() {
        let folder = good();
        let (path, line) = make(mistake, folder.path());
        let verb = ["run", "plan", "measure"][k % 3];
        let what = format!("{verb}: {} for {}", mistake.new, mistake.old);
        let error = refusal(&what, &calibench(folder.path(), &[verb, "s.toml", "-o", OUT]));
        let file = path.file_name().expect("a name").to_string_lossy().into_owned();
        let place = line.map_or_else(|| mistake.field.to_owned(), |line| format!("{file}:{line}: "));
        assert!(error.contains(&place) && error.contains(mistake.remedy), "{what}: {error}");
        assert!(!folder.path().join(OUT).exists(), "{what}");
    }
}

#[test]
fn a_cell_that_cannot_be_is_named_and_leaves_what_was_there() {
    let mut wrong = Vec::new();
    for mistake in impossible_cells() {
        let folder = good();
        let (path, line) = make(&mistake, folder.path());
        let what = format!("{} for {}", mistake.new, mistake.old);
        // An earlier run, recognised by its marker file.
        let earlier = folder.path().join(OUT);
        fs::create_dir(&earlier).expect("writable");
        fs::write(earlier.join("result.json"), "{}").expect("writable");
        let error = refusal(&what, &calibench(folder.path(), &["run", "s.toml", "--out", OUT]));
        let file = path.file_name().expect("a name").to_string_lossy().into_owned();
        let place = format!("{file}:{}: {}: ", line.expect("every one has its place"), mistake.field);
        if !error.contains(&place) || !error.contains(mistake.remedy) {
            wrong.push(format!("{what}: not {place} {:?}: {error}", mistake.remedy));
        }
        assert_eq!(fs::read_to_string(earlier.join("result.json")).expect("still there"), "{}", "{what}");
        assert_eq!(fs::read_dir(&earlier).expect("a folder").count(), 1, "{what}");
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 3, "{what}: nothing else is left behind");
    }
    assert!(wrong.is_empty(), "{} of the cells:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn scenario_files_that_are_none() {
    let folder = good();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("empty.toml"), "").expect("writable");
    fs::write(at("bytes.toml"), b"format = \"\xff\"").expect("writable");
    fs::write(at("prose.toml"), "See the other file.").expect("writable");
    let text = fs::read_to_string(at("s.toml")).expect("a text");
    fs::write(at("cut.toml"), &text[..text.len() - 10]).expect("writable");
    fs::create_dir(at("folder.toml")).expect("writable");
    for name in ["empty.toml", "bytes.toml", "prose.toml", "cut.toml", "folder.toml", "none.toml"] {
        // As the scenario, and as the file it extends.
        let error = refusal(name, &calibench(folder.path(), &["run", name, "-o", OUT]));
        assert!(error.contains(name), "{error}");
        fs::write(at("child.toml"), text.replace("kr6-trical.toml", name)).expect("writable");
        let error = refusal(name, &calibench(folder.path(), &["plan", "child.toml", "-o", OUT]));
        assert!(error.contains(name), "{error}");
        assert!(!at(OUT).exists());
    }
}

/// A measured cell: `d` the TriCal's dataset, `v` the validation points, `c.toml` the calibration, `p.toml` the plan.
fn measured() -> TempDir {
    let folder = good();
    for arguments in [
        &["run", "s.toml", "--out", "r"][..],
        &["plan", "s.toml", "-o", "p.toml"],
        &["identify", "r/trical", "-o", "c.toml"],
        &["validate", "c.toml", "r/validation"],
    ] {
        let output = calibench(folder.path(), arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    folder
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).expect("writable");
    for name in ["dataset.toml", "samples.csv"] {
        fs::copy(from.join(name), to.join(name)).expect("writable");
    }
}

#[test]
fn data_and_calibrations_that_do_not_go_together() {
    let folder = measured();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("empty")).expect("writable");
    copy(&at("r/trical"), &at("few"));
    let rows = fs::read_to_string(at("few/samples.csv")).expect("a text");
    fs::write(at("few/samples.csv"), rows.lines().take(5).map(|l| format!("{l}\n")).collect::<String>()).expect("writable");
    copy(&at("r/validation"), &at("other"));
    replace(&at("other/dataset.toml"), "kr6_r700", "ur10");
    copy(&at("r/trical"), &at("other_fit"));
    replace(&at("other_fit/dataset.toml"), "kr6_r700", "ur10");
    copy(&at("r/trical"), &at("again"));
    fs::write(at("again/samples.csv"), rows.lines().take(40).map(|l| format!("{l}\n")).collect::<String>()).expect("writable");
    copy(&at("r/trical"), &at("seven"));
    replace(&at("seven/dataset.toml"), "kr6_r700", "panda");
    fs::write(at("m.toml"), "effects = [\n\"mhd\"]\n").expect("writable");
    fs::write(at("backlash.toml"), "effects = [\"ball:1\"]\n").expect("writable");
    let calibration = fs::read_to_string(at("c.toml")).expect("a text");
    fs::write(at("nan.toml"), calibration.replacen("chi2_per_dof = ", "chi2_per_dof = nan # ", 1)).expect("writable");
    for (arguments, named) in [
        (&["identify", "nosuch", "-o", OUT][..], &["nosuch/dataset.toml", "a dataset is a folder"][..]),
        (&["identify", "empty", "-o", OUT], &["empty/dataset.toml", "a dataset is a folder"]),
        (&["identify", "c.toml", "-o", OUT], &["c.toml", "name the folder"]),
        (&["identify", "r/validation", "-o", OUT], &["r/validation/samples.csv", "set", "rows of that set"]),
        (&["identify", "few", "-o", OUT], &["few/samples.csv", "12 residuals", "measure more poses"]),
        (&["identify", "seven", "-o", OUT], &["seven/", ":"]),
        (&["identify", "r/trical", "again", "-o", OUT], &["again/samples.csv: rows", "also in trical", "count twice"]),
        (&["identify", "r/trical", "other_fit", "-o", OUT], &["other_fit/dataset.toml: robot", "one robot at a time"]),
        (&["identify", "r/trical", "--model", "m.toml", "-o", OUT], &["m.toml:2: effects[0]", "did you mean `mdh`"]),
        (
            &["identify", "r/tracker", "--model", "backlash.toml", "-o", OUT],
            &["backlash.toml: effects", "leave the effect out"],
        ),
        (&["identify", "r/trical", "--model", "none.toml", "-o", OUT], &["none.toml", "check the path"]),
        (&["validate", "c.toml", "nosuch"], &["nosuch/dataset.toml", "a dataset is a folder"]),
        (&["validate", "none.toml", "r/validation"], &["none.toml", "check the path"]),
        (&["validate", "r", "r/validation"], &["r: is a directory", "name a file"]),
        (&["validate", "nan.toml", "r/validation"], &["nan.toml:", "fit.chi2_per_dof", "finite"]),
        (&["validate", "c.toml", "other"], &["other/dataset.toml: robot", "'kr6_r700'", "'ur10'"]),
        (&["measure", "s.toml", "--plan", "c.toml", "-o", OUT], &["c.toml:", "known here"]),
        (&["measure", "s.toml", "--plan", "none.toml", "-o", OUT], &["none.toml", "check the path"]),
        (&["import", "nosuch", "x.csv", "-o", OUT], &["nosuch", "ur10-ipa"]),
        (&["import", "ur10-ipa", "x.csv", "-o", OUT], &["x.csv", "check the path"]),
        (&["import", "ur10-ipa", "r", "-o", OUT], &["r: is a directory", "name the files"]),
        (&["import", "ur10-ipa", "few/samples.csv", "-o", OUT], &["few/samples.csv:1: shoulder_pan_joint", "this file has"]),
        (&["import", "mukca", "empty", "-o", OUT], &["empty: ", "name the folder"]),
        (&["import", "generic", "few/samples.csv", "-o", OUT], &["--map"]),
        (&["import", "generic", "few/samples.csv", "--map", "none.toml", "-o", OUT], &["none.toml", "check the path"]),
        (&["import", "generic", "few/samples.csv", "--map", "s.toml", "-o", OUT], &["s.toml:", "known here"]),
        (&["import", "ur10-ipa", "few/samples.csv", "--holdout", "nan", "-o", OUT], &["--holdout", "share"]),
        (&["run"], &["<SCENARIO>", "--help"]),
        (&["run", "s.toml", "again"], &["'again'", "--help"]),
        (&["run", "s.toml", "--seed", "-1"], &["--seed", "whole number"]),
        (&["run", "s.toml", "--out", ""], &["--out", "--help"]),
        (&["optimise"], &["'optimise'", "--help"]),
    ] {
        let error = refusal(&format!("{arguments:?}"), &calibench(folder.path(), arguments));
        assert!(named.iter().all(|part| error.contains(part)), "{arguments:?}: {error}");
        assert!(!at(OUT).exists(), "{arguments:?}");
    }
}

/// Accidents with good input: a pipe instead of a file, a file of zeros, an endless expression, a missing sample.
#[cfg(unix)]
#[test]
fn what_is_no_input_is_told_in_a_line() {
    let folder = measured();
    let at = |name: &str| folder.path().join(name);
    let made = Command::new("mkfifo").arg(at("pipe")).status().expect("mkfifo is there");
    assert!(made.success());
    for name in ["piped", "zeros", "early"] {
        copy(&at("r/trical"), &at(name));
    }
    fs::remove_file(at("piped/samples.csv")).expect("there");
    fs::rename(at("pipe"), at("piped/samples.csv")).expect("writable");
    assert!(Command::new("mkfifo").arg(at("pipe")).status().expect("mkfifo is there").success());
    fs::write(at("zeros/samples.csv"), vec![0; 1 << 21]).expect("writable");
    fs::write(at("zeros.toml"), vec![0; 1 << 21]).expect("writable");
    let effect = |unit: &str, basis: &str| {
        format!(
            "effects = [\"mdh\"]\n[[effect]]\nname = \"own\"\nunit = \"{unit}\"\nterms = [{{ site = \"theta:3\", basis = \"{basis}\" }}]\n"
        )
    };
    fs::write(at("long.toml"), effect("deg", &["sin(q3)"; 9_000].join("+"))).expect("writable");
    fs::write(at("mm.toml"), effect("mm", "sin(q3)")).expect("writable");
    fs::write(at("kg.toml"), effect("kg", "sin(q3)")).expect("writable");
    let rows = fs::read_to_string(at("r/trical/samples.csv")).expect("a text");
    let (header, first) = rows.split_once('\n').expect("a header");
    let time = header.split(',').position(|c| c == "time_s").expect("it is logged");
    let row = first.lines().next().expect("a row");
    let mut cells: Vec<&str> = row.split(',').collect();
    cells[time] = "-5";
    fs::write(at("early/samples.csv"), rows.replacen(row, &cells.join(","), 1)).expect("writable");
    let validation = fs::read_to_string(at("r/validation/samples.csv")).expect("a text");
    let kept = validation.lines().nth(1).and_then(|l| l.split(',').next()).expect("an id");
    let outlier = format!("outlier:{kept}");
    for (arguments, named) in [
        (&["identify", "r/trical", "--model", "pipe", "-o", OUT][..], &["pipe: cannot be read", "pipe or a device"][..]),
        (&["diagnose", "piped"], &["piped/samples.csv: cannot be read", "pipe or a device"]),
        (&["run", "pipe"], &["pipe: cannot be read", "pipe or a device"]),
        (&["import", "generic", "pipe", "--map", "pipe", "-o", OUT], &["pipe: cannot be read", "pipe or a device"]),
        (&["compensate", "c.toml", "pipe", "-o", OUT], &["pipe: cannot be read", "pipe or a device"]),
        (&["diagnose", "zeros"], &["zeros/samples.csv", ":"]),
        (&["identify", "r/trical", "--model", "zeros.toml", "-o", OUT], &["zeros.toml:1: is not text: it holds NUL bytes"]),
        (
            &["identify", "r/trical", "--model", "long.toml", "-o", OUT],
            &["long.toml:5: effect[0].terms[0].basis", "500 characters"],
        ),
        (&["identify", "r/trical", "--model", "mm.toml", "-o", OUT], &["mm.toml:4: effect[0].unit", "which turn", "give deg"]),
        (&["identify", "r/trical", "--model", "kg.toml", "-o", OUT], &["kg.toml:4: effect[0].unit", "is not a unit"]),
        (&["diagnose", "early"], &["early/samples.csv:2: time_s", "-5 is impossible"]),
        (&["add", "outlier:nope", "r/trical"], &["there is no sample 'nope'", "outlier:ID"]),
        (&["add", &outlier, "r/trical"], &["there is no sample", "among the rows that are fitted"]),
    ] {
        let error = refusal(&format!("{arguments:?}"), &calibench(folder.path(), arguments));
        assert!(named.iter().all(|part| error.contains(part)) && error.len() < 600, "{arguments:?}: {error}");
    }
}

/// A dataset given twice, by its name, another path or as a copy, is counted once, and this is reported.
#[test]
fn data_given_twice_count_once() {
    let folder = measured();
    copy(&folder.path().join("r/trical"), &folder.path().join("copy"));
    let told = |arguments: &[&str]| {
        let output = calibench(folder.path(), arguments);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{arguments:?}: {error}");
        (output.stdout, error)
    };
    let (once, _) = told(&["diagnose", "r/trical", "--json"]);
    let samples = |out: &[u8]| serde_json::from_slice::<serde_json::Value>(out).expect("JSON")["samples"].clone();
    for second in ["r/trical", "r/../r/trical", "copy"] {
        let (out, error) = told(&["diagnose", "r/trical", second, "--json"]);
        assert!(error.contains("counted once"), "{second}: {error}");
        assert_eq!(samples(&out), samples(&once), "{second}");
    }
    let (_, error) = told(&["ladder", "r/trical", "--check", "copy", "--json"]);
    assert!(error.contains("copy is among the data that are fitted"), "{error}");

    // A clock set during the session: its times are used, with a warning.
    let rows = fs::read_to_string(folder.path().join("copy/samples.csv")).expect("a text");
    let (header, _) = rows.split_once('\n').expect("a header");
    let time = header.split(',').position(|c| c == "time_s").expect("it is logged");
    let last = rows.lines().last().expect("a row");
    let mut cells: Vec<&str> = last.split(',').collect();
    cells[time] = "1800000000";
    fs::write(folder.path().join("copy/samples.csv"), rows.replacen(last, &cells.join(","), 1)).expect("writable");
    for verb in ["identify", "diagnose"] {
        let (_, error) = told(&[verb, "r/trical"]);
        assert!(!error.contains("time_s"), "{verb}: {error}");
        let (_, error) = told(&[verb, "copy"]);
        let warning = "warning: copy/samples.csv: the times span 20833 days";
        assert!(error.contains(warning) && error.matches("time_s").count() >= 1, "{verb}: {error}");
    }
}

#[test]
fn an_output_that_is_in_the_way_stays() {
    let folder = measured();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("file"), "mine").expect("writable");
    fs::create_dir(at("house")).expect("writable");
    fs::write(at("house/letter"), "mine").expect("writable");
    for output in ["file", "house", "file/below"] {
        for arguments in [
            &["run", "s.toml", "--out", output][..],
            &["measure", "s.toml", "--plan", "p.toml", "-o", output],
            &["identify", "r/trical", "-o", if output == "file" { "house" } else { output }],
            &["plan", "s.toml", "-o", if output == "file" { "house" } else { output }],
        ] {
            let error = refusal(&format!("{arguments:?}"), &calibench(folder.path(), arguments));
            assert!(error.contains(arguments[arguments.len() - 1]), "{error}");
            assert_eq!(fs::read_to_string(at("file")).expect("there"), "mine");
            assert_eq!(fs::read_to_string(at("house/letter")).expect("there"), "mine");
            assert_eq!(fs::read_dir(at("house")).expect("there").count(), 1);
        }
    }
}

/// Every verb that works for its output checks that first: the input is not even looked for.
#[cfg(target_os = "linux")]
#[test]
fn an_output_that_cannot_be_written_is_told_before_the_work() {
    use std::os::unix::fs::{PermissionsExt, symlink};

    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("file"), "mine").expect("writable");
    fs::create_dir(at("house")).expect("writable");
    fs::write(at("house/letter"), "mine").expect("writable");
    fs::create_dir(at("locked")).expect("writable");
    fs::set_permissions(at("locked"), fs::Permissions::from_mode(0o555)).expect("ours");
    symlink("circle", at("circle")).expect("writable");
    // A privileged user may write there too; nobody can create files in /proc.
    let locked = if fs::write(at("locked/x"), "").is_ok() { "/proc/locked/x" } else { "locked/x" };
    let files = [
        &["identify", "no", "-o"][..],
        &["ladder", "no", "-o"],
        &["add", "mdh", "no", "-o"],
        &["plan", "next", "no", "-o"],
        &["report", "no", "-o"],
        &["effects", "prove", "no", "-o"],
        &["plan", "no", "-o"],
        &["sim", "suite", "no", "-o"],
        &["sim", "study", "no", "--trials", "1", "-o"],
        &["sim", "study", "no", "--trials", "1", "--report"],
        &["sim", "merge", "no", "-o"],
        &["sim", "design", "no", "-o"],
        &["sim", "design", "no", "--report"],
        &["compensate", "no", "no.csv", "-o"],
        &["compensate", "no", "--urdf"],
    ];
    for arguments in files {
        for (output, why) in [
            ("house", "is a directory"),
            ("file/below/x", "file is a file"),
            (locked, "cannot be written"),
            ("circle", "lead in a circle"),
        ] {
            let error = refusal(output, &calibench(folder.path(), &[arguments, &[output]].concat()));
            assert!(error.contains(output) && error.contains(why), "{arguments:?} {output}: {error}");
        }
        let full = calibench(folder.path(), &[arguments, &["/dev/full"]].concat());
        let error = String::from_utf8_lossy(&full.stderr).into_owned();
        assert_eq!(full.status.code(), Some(3), "{arguments:?}: {error}");
        assert!(error.contains("/dev/full: cannot be written"), "{arguments:?}: {error}");
        // If the output can be written, the input is reported.
        for output in ["new", "below/new", "file", "/dev/null"] {
            let error = refusal(output, &calibench(folder.path(), &[arguments, &[output]].concat()));
            assert!(error.contains("calibench: no"), "{arguments:?} {output}: {error}");
        }
    }
    for arguments in [&["run", "no", "-o"][..], &["import", "ur10-ipa", "no", "-o"], &["compare", "no", "no", "--plots"]] {
        for (output, why) in [
            ("file", "is a file"),
            ("house", "holds something"),
            ("file/below", "file is a file"),
            (locked, "cannot be written"),
        ] {
            let error = refusal(output, &calibench(folder.path(), &[arguments, &[output]].concat()));
            assert!(error.contains(output) && error.contains(why), "{arguments:?} {output}: {error}");
        }
    }
    let mut left: Vec<_> = fs::read_dir(folder.path()).expect("a folder").map(|e| e.expect("an entry").file_name()).collect();
    left.sort();
    assert_eq!(left, ["circle", "file", "house", "locked"], "nothing is left behind");
    assert_eq!(fs::read_to_string(at("file")).expect("there"), "mine");
}

/// Files and folders get the permissions of the user's umask, and links are written through.
#[cfg(unix)]
#[test]
fn outputs_respect_the_umask_and_links() {
    use std::os::unix::fs::{PermissionsExt, symlink};

    let folder = good();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("there.toml"), "").expect("writable");
    fs::set_permissions(at("there.toml"), fs::Permissions::from_mode(0o600)).expect("ours");
    for (link, to) in [("link.toml", "there.toml"), ("new.toml", "below/made.toml")] {
        symlink(to, at(link)).expect("writable");
    }
    let program = env!("CARGO_BIN_EXE_calibench");
    let run = |arguments: &str| {
        let script = format!("umask 027; exec '{program}' {arguments}");
        let output = Command::new("sh").current_dir(folder.path()).args(["-c", &script]).output().expect("a shell");
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    };
    let mode = |name: &str| fs::metadata(at(name)).expect("there").permissions().mode() & 0o777;
    for output in ["plain.toml", "link.toml", "new.toml"] {
        run(&format!("plan s.toml -o {output}"));
    }
    assert_eq!((mode("plain.toml"), mode("below/made.toml")), (0o640, 0o640));
    assert_eq!(mode("there.toml"), 0o600, "as before");
    for link in ["link.toml", "new.toml"] {
        assert!(fs::symlink_metadata(at(link)).expect("there").is_symlink(), "{link}");
        assert_eq!(fs::read(at(link)).expect("a plan"), fs::read(at("plain.toml")).expect("a plan"));
    }
    run("measure s.toml --plan plain.toml -o data");
    assert_eq!((mode("data"), mode("data/samples.csv")), (0o750, 0o640));
}

#[cfg(unix)]
#[test]
fn paths_may_have_spaces_and_bytes_that_are_no_text() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let folder = good();
    let odd = folder.path().join(OsStr::from_bytes(b"no \xff text"));
    fs::create_dir(&odd).expect("writable");
    for name in ["s.toml", "kr6-trical.toml"] {
        fs::copy(folder.path().join(name), odd.join(name)).expect("writable");
    }
    for arguments in [
        &["plan", "s.toml", "-o", "p l.toml"][..],
        &["measure", "s.toml", "--plan", "p l.toml", "-o", "d s"],
        &["identify", "d s", "-o", "c b.toml"],
        &["validate", "c b.toml", "d s", "--fitted"],
    ] {
        let output = calibench(&odd, arguments);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    let output = command.arg("identify").arg(odd.join("d s")).arg("-o").arg(odd.join("again")).output().expect("it runs");
    assert!(output.status.success() && odd.join("again").is_file());
}

/// Arms of other kinds: a robot file is included in the output, and an arm that cannot probe is rejected.
#[test]
fn any_robot_runs_or_is_refused() {
    let lists = ["noise]", "joint_arcsec", "servo_error_arcsec", "lost_motion_arcsec", "small_move_play_arcsec"];
    let folder = good();
    let at = |name: &str| folder.path().join(name);
    let kr6 = built_in("kr6_r700").expect("built in");
    // A degenerate model: one joint, no lengths at all, limits narrower than any margin.
    let mut one = kr6.clone();
    one.links.truncate(1);
    one.solids.clear();
    let mut flat = kr6.clone();
    flat.links.iter_mut().for_each(|l| (l.mdh.a, l.mdh.d, l.mdh.alpha, l.mdh.theta) = (0.0, 0.0, 0.0, 0.0));
    let mut narrow = kr6.clone();
    narrow.links.iter_mut().for_each(|l| l.limits = [-0.01, 0.01]);
    // With one more joint there is no closed form.
    let mut narrow_seven = narrow.clone();
    narrow_seven.links.push(narrow.links[5].clone());
    narrow_seven.gear_ratios.clear();
    for (name, arm, runs) in [
        ("kr6", &kr6, true),
        ("one", &one, false),
        ("flat", &flat, false),
        ("narrow", &narrow, false),
        ("seven", &narrow_seven, false),
    ] {
        let mut arm = arm.clone();
        arm.gear_ratios.truncate(arm.links.len());
        fs::write(at("arm.toml"), to_toml(&arm)).expect("writable");
        let numbers = vec!["1.0"; arm.joints()].join(", ");
        let text =
            fs::read_to_string(at("kr6-trical.toml")).expect("a text").replace("robot = \"kr6_r700\"", "robot = \"arm.toml\"");
        let list = |line: &str| lists.iter().find(|key| line.starts_with(*key)).map(|key| format!("{key} = [{numbers}]"));
        let text: Vec<String> = text.lines().map(|l| list(l).unwrap_or_else(|| l.to_owned())).collect();
        fs::write(at("cell.toml"), text.join("\n")).expect("writable");
        let question = "format = \"calibench-scenario/1\"\nextends = \"cell.toml\"\nname = \"n\"\nquestion = \"q\"\nseed = 1\n";
        fs::write(at("arm-cell.toml"), question).expect("writable");
        let output = calibench(folder.path(), &["run", "arm-cell.toml", "--out", "r"]);
        if runs {
            assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
            for arguments in [
                &["validate", "r/trical.toml", "r/validation"][..],
                &["identify", "r/trical", "-o", "c.toml"],
                &["validate", "c.toml", "r/validation"],
            ] {
                let output = calibench(folder.path(), arguments);
                assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
            }
        } else {
            let error = refusal(name, &output);
            assert!(error.contains("cell.toml:") && error.contains("ball[0]"), "{name}: {error}");
        }
    }
}

/// `calibench robots | head -1`: the reader closes the pipe early.
#[test]
fn a_closed_pipe_is_not_a_panic() {
    for verb in [&["robots"][..], &["effects", "--json"], &["--help"]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
        let mut child = command.args(verb).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program runs");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn help_is_no_error_but_for_who_asked_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let alone = calibench(folder.path(), &[]);
    assert_eq!(alone.status.code(), Some(2));
    assert!(alone.stdout.is_empty() && String::from_utf8_lossy(&alone.stderr).contains("Usage: calibench"));
    for arguments in [&["--help"][..], &["--version"], &["run", "--help"], &["help", "import"]] {
        let output = calibench(folder.path(), arguments);
        assert!(output.status.success() && !output.stdout.is_empty() && output.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn random_damage_to_a_scenario_never_panics() {
    let folder = good();
    let path = folder.path().join("s.toml");
    // One file that contains everything, so that everything can be damaged.
    let own: Vec<&str> = QUESTION.lines().take_while(|l| !l.starts_with('[')).filter(|l| !l.starts_with("extends")).collect();
    let whole = format!("{}\n{}", own.join("\n"), fs::read_to_string(folder.path().join("kr6-trical.toml")).expect("a text"));
    fs::write(&path, &whole).expect("writable");
    load_scenario(&path).unwrap_or_else(|e| panic!("{e}"));
    let whole = whole.into_bytes();
    let mut random = ChaCha8Rng::seed_from_u64(20_201_019);
    let mut refused = 0;
    for _ in 0..2000 {
        let mut bytes = whole.clone();
        for _ in 0..random.random_range(1..4) {
            let at = random.random_range(0..bytes.len());
            let end = at + random.random_range(0..(bytes.len() - at).min(40));
            match random.random_range(0..8) {
                0 => bytes[at] ^= 1 << random.random_range(0..8),
                1 => bytes.truncate(at.max(1)),
                2 => drop(bytes.drain(at..end)),
                3 => {
                    let piece = bytes[at..end].to_vec();
                    bytes.splice(end..end, piece);
                }
                _ => {
                    // The next number is replaced.
                    let digit = |b: &u8| b.is_ascii_digit() || b".-".contains(b);
                    let from = at + bytes[at..].iter().take_while(|b| !digit(b)).count();
                    let to = from + bytes[from..].iter().take_while(|b| digit(b)).count();
                    let other =
                        ["nan", "-inf", "1e300", "-1e300", "-1", "0", "1e-300", "9223372036854775807", "99999999999999999999"];
                    bytes.splice(from..to, other[random.random_range(0..other.len())].bytes());
                }
            }
        }
        fs::write(&path, &bytes).expect("writable");
        if let Err(e) = load_scenario(&path) {
            refused += 1;
            assert!(!e.problem.is_empty() && !e.remedy.is_empty() && !e.to_string().contains('\n'), "{e}");
        }
    }
    // Comments and names can be damaged without harm; most other text cannot.
    assert!(refused > 1000, "only {refused} of 2000 damaged scenarios were refused");
}
