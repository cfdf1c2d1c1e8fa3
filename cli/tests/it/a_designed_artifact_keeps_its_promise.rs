//! An artifact designed by `calibench sim design` has its balls in the most informative places, is as accurate as predicted, and
//! runs as a scenario.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use calibench_sim::scenario::load_scenario;
use serde_json::Value;
use tempfile::TempDir;

const SCENARIOS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios");

/// Balls 1 and 2 stay, the third is placed on a coarse grid, whose row at y = -20 lies within 0.1 mm of the line through them.
const THIRD_BALL: &str = r#"
[design]
balls = 3
fixed = ["1", "2"]
without = ["riser 3", "stem 3", "stem 4"]
min_mm = [-79.4, -220.0, -60.0]
max_mm = [120.6, 180.0, 300.0]
step_mm = 200.0
riser_heights_mm = [28.1, 200.0]
table_mm = -60.0
riser_kg = 1.0
probings = 60
pool_per_place = 60
workspace_poses = 40
finalists = 1
"#;

/// All three balls are placed by the designer.
const THREE_BALLS: &str = r#"
[design]
balls = 3
min_mm = [-150.0, -300.0, -60.0]
max_mm = [50.0, 300.0, 300.0]
step_mm = 100.0
riser_heights_mm = [30.0, 200.0]
table_mm = -60.0
plate_kg_per_m2 = 27.0
riser_kg = 1.0
riser_kg_per_m = 6.0
most_kg = 12.0
probings = 60
pool_per_place = 60
workspace_poses = 40
starts = 3
finalists = 1
scales = [1.0, 0.7]
"#;

fn folder(design: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let table8 = fs::canonicalize(Path::new(SCENARIOS).join("table8.toml")).expect("the scenario");
    let head = format!(
        "format = \"calibench-scenario/1\"\nextends = '{}'\nname = \"d\"\nquestion = \"where?\"\nseed = 1\n\
         [plan]\npool_per_ball = 150\nstarts = 1\nreserves_per_ball = 1\n",
        table8.display()
    );
    fs::write(folder.path().join("s.toml"), head + design).expect("writable");
    folder
}

fn calibench(folder: &Path, threads: &str, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).env("RAYON_NUM_THREADS", threads).args(arguments).output().expect("the program runs")
}

fn designed(folder: &Path, more: &[&str]) -> Value {
    let output = calibench(folder, "2", &[&["sim", "design", "s.toml", "--json"], more].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// Two balls leave the base free about the line through them; a third within 0.1 mm of that line determines it a thousand times
/// less well than one 200 mm away. A factor of ten is far beyond the influence of noise or of the choice of poses.
#[test]
fn a_ball_in_line_with_the_others_is_never_chosen() {
    let folder = folder(THIRD_BALL);
    let design = designed(folder.path(), &["--trials", "0"]);
    let best = number(&design["best"]["worst_um"]);
    let third = &design["best"]["balls"][2][1];
    let is_in_line = |at: &Value| (number(&at[0]) + 79.4).abs() < 0.1 && (number(&at[2]) - 18.1).abs() < 0.1;
    assert!(!is_in_line(third), "{third}");
    let map = design["map"].as_array().expect("a map");
    let in_line: Vec<&Value> = map.iter().filter(|m| is_in_line(&m["centre_mm"])).collect();
    assert!(!in_line.is_empty() && map.len() > in_line.len());
    for place in in_line {
        assert!(place["worst_um"].as_f64().is_none_or(|worst| worst > 10.0 * best), "{place} against {best}");
    }
}

/// Over 60 trials the band of a root mean square is some 5 % to either side, that of one pose some 15 %; effects neglected by
/// the prediction (the model is linearised at the nominal one, indicator errors are not normal) contribute 5 % more.
#[test]
fn the_prediction_is_what_the_simulated_cell_shows_and_the_artifact_runs() {
    let folder = folder(THREE_BALLS);
    let design = designed(folder.path(), &["--trials", "60", "-o", "artifact.toml"]);
    /// Tolerance of the prediction beyond the band of the trials, as a share of its ends.
    const LEFT_OUT: f64 = 0.05;
    for judged in std::iter::once(&design["best"]).chain(design["compared"].as_array().expect("a list")) {
        assert_eq!(judged["verified"]["failed"], 0, "{judged}");
        for which in ["rms", "worst"] {
            let held = &judged["verified"][which];
            let [low, high] = [&held["band_um"][0], &held["band_um"][1]].map(number);
            let predicted = number(&held["predicted_um"]);
            assert!((low * (1.0 - LEFT_OUT)..=high * (1.0 + LEFT_OUT)).contains(&predicted), "{}: {held}", judged["name"]);
        }
    }
    assert!(number(&design["best"]["mass_kg"]) <= 12.0);
    // A smaller box cannot hold a better artifact than the whole, which contains its places.
    let front: Vec<f64> =
        design["front"].as_array().expect("a front").iter().map(|f| number(&f["judged"]["worst_um"])).collect();
    assert!(front[1] > front[0], "{front:?}");
    let scenario = load_scenario(&folder.path().join("artifact.toml")).expect("a scenario");
    let balls: Vec<Value> = scenario.dataset().balls.iter().map(|b| (b.position * 1000.0).as_slice().into()).collect();
    for (ball, stated) in balls.iter().zip(design["best"]["balls"].as_array().expect("balls")) {
        assert!((0..3).all(|i| (number(&ball[i]) - number(&stated[1][i])).abs() < 1e-6), "{ball} {stated}");
    }
    let plan = calibench(folder.path(), "2", &["plan", "artifact.toml"]);
    assert!(plan.status.success(), "{}", String::from_utf8_lossy(&plan.stderr));
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let folder = folder(THREE_BALLS);
    let made = |threads: &str, seed: &str| {
        let arguments = ["sim", "design", "s.toml", "--trials", "4", "--seed", seed, "-o", "a.toml", "--report", "a.html"];
        let output = calibench(folder.path(), threads, &arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let [artifact, page] = ["a.toml", "a.html"].map(|f| fs::read(folder.path().join(f)).expect("a file"));
        (output.stdout, artifact, page)
    };
    let first = made("1", "3");
    assert!(first == made("3", "3"), "another number of threads");
    assert!(first.0 != made("2", "4").0, "another seed");
}

#[test]
fn bad_input_ends_in_one_clear_error_that_names_the_key() {
    for (old, new, key, remedy) in [
        ("balls = 3", "balls = 2", "design.balls", "from 3 to 8"),
        ("balls = 3", "balls = 9", "design.balls", "from 3 to 8"),
        ("balls = 3", "ball = 3", "design.ball", "no such key"),
        ("[\"1\", \"2\"]", "[\"1\", \"7\"]", "design.fixed", "by their id"),
        ("[\"1\", \"2\"]", "[\"1\", \"2\", \"3\"]", "design.fixed", "leave at least one"),
        ("\"stem 4\"", "\"stem 9\"", "design.without", "[[solid]]"),
        ("min_mm = [-79.4", "min_mm = [200.0", "design.min_mm", "least corner"),
        (
            "min_mm = [-79.4, -220.0, -60.0]\nmax_mm = [120.6,",
            "min_mm = [3000.0, -220.0, -60.0]\nmax_mm = [3200.0,",
            "design.min_mm",
            "move the box",
        ),
        ("step_mm = 200.0", "step_mm = 0.0", "design.step_mm", "positive"),
        ("step_mm = 200.0", "step_mm = 0.1", "design.step_mm", "wider step"),
        ("[28.1, 200.0]", "[200.0, 28.1]", "design.riser_heights_mm", "lowest first"),
        ("riser_kg = 1.0", "riser_kg = -1.0", "design.riser_kg", "zero or"),
        ("riser_kg = 1.0", "riser_kg = 5.0\nmost_kg = 2.0", "design", "more mass"),
        ("probings = 60", "probings = 0", "design.probings", "from 12"),
        ("finalists = 1", "finalists = 1\nscales = [0.5]", "design.scales", "leave out"),
        ("[design]", "[elsewhere]", "elsewhere", ""),
    ] {
        assert!(THIRD_BALL.contains(old), "{old}");
        let folder = folder(&THIRD_BALL.replacen(old, new, 1));
        let output = calibench(folder.path(), "2", &["sim", "design", "s.toml", "--trials", "0", "-o", "out.toml"]);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{new}: {error}");
        assert!(output.stdout.is_empty() && error.matches('\n').count() == 1, "{new}: {error}");
        assert!(error.contains(&format!("{key}: ")) && error.contains(remedy), "{new}: {error}");
        assert!(!folder.path().join("out.toml").exists());
    }
    let folder = folder("");
    let output = calibench(folder.path(), "2", &["sim", "design", "s.toml"]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && error.contains("design: is missing"), "{error}");
}
