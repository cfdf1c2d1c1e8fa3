//! The folder of a run becomes a recording that the viewer itself verifies, with all animated entities in it; the same run
//! gives the same recording. Needs the viewer for its verdict (docs/replay.md); if it is missing that part is skipped, unless
//! skipping is forbidden.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::Instant;

use calibench::files::read_text;

/// Largest size of a recording of 80 probings, bytes: small enough to be mailed.
const LARGEST: u64 = 30_000_000;
/// Longest time to write it, s.
const LONGEST_S: f64 = 10.0;

/// A run of the paper's experiment: 80 probings, four missed, 500 validation points.
fn run() -> &'static Path {
    static RUN: OnceLock<tempfile::TempDir> = OnceLock::new();
    RUN.get_or_init(|| make_run("gear-ripple", "1")).path()
}

fn make_run(scenario: &str, seed: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenarios/{scenario}.toml"));
    let run = folder.path().join("run");
    let arguments = ["calibench", "run", scenario.to_str().unwrap(), "--seed", seed, "--out", run.to_str().unwrap()];
    calibench_cli::verbs::main_with(arguments);
    assert!(run.join("result.json").is_file(), "the run was not written");
    folder
}

fn view(arguments: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calibench-view")).args(arguments).output().unwrap()
}

/// Records a folder into a file.
fn record(folder: &Path, recording: &Path) -> String {
    let output = view(&[folder, Path::new("-o"), recording]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    said
}

/// The viewer, if it is installed.
fn viewer() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let named = std::env::var_os("CALIBENCH_VENV").map(PathBuf::from);
    let venvs = named.into_iter().chain([root.join(".venv-view"), root.join(".venv")]);
    let pythons = venvs.flat_map(|venv| fs::read_dir(venv.join("lib")).into_iter().flatten().flatten());
    let found = pythons.map(|p| p.path().join("site-packages/rerun_sdk/rerun_cli/rerun")).find(|p| p.is_file());
    if found.is_none() {
        assert!(
            std::env::var_os("CALIBENCH_REQUIRE_ALL").is_none(),
            "there is no rerun; docs/replay.md says how to install it"
        );
        println!("skipped: there is no rerun viewer; docs/replay.md says how to install it");
    }
    found
}

fn rrd(viewer: &Path, verb: &str, files: &[&Path]) -> Output {
    Command::new(viewer).args(["rrd", verb]).args(files).env("NO_COLOR", "1").output().unwrap()
}

#[test]
fn a_recording_is_small_and_soon_made() {
    let recording = run().join("timed.rrd");
    let began = Instant::now();
    let said = record(&run().join("run"), &recording);
    let took = began.elapsed().as_secs_f64();
    assert_eq!(said, "", "nothing is missing in the folder of a run");
    let size = fs::metadata(&recording).unwrap().len();
    println!("{size} bytes in {took:.2} s");
    assert!(size < LARGEST && took < LONGEST_S, "{size} bytes in {took} s");
}

/// Number of rows of every chunk of an entity, fewest first, from the lines printed by the viewer for a recording:
/// `Chunk(ID) with 414 rows (80 KiB) - ENTITY - data columns: [...]`.
fn rows(printed: &str, entity: &str) -> Vec<usize> {
    let named = format!(" - {entity} - ");
    let pieces = printed.lines().filter(|line| line.contains(&named));
    let count = |line: &str| {
        let (_, after) = line.split_once(") with ")?;
        let digits: String = after.split_once(" rows")?.0.chars().filter(char::is_ascii_digit).collect();
        digits.parse().ok()
    };
    let mut rows: Vec<usize> = pieces.map(|line| count(line).unwrap_or_else(|| panic!("no rows: {line}"))).collect();
    rows.sort_unstable();
    rows
}

/// Data rows of a table of the run.
fn data_rows(path: &Path) -> usize {
    read_text(path).unwrap().lines().count() - 1
}

#[test]
fn the_viewer_finds_everything_that_moves_at_every_stop() {
    let Some(viewer) = viewer() else { return };
    let recording = run().join("whole.rrd");
    record(&run().join("run"), &recording);
    let verified = rrd(&viewer, "verify", &[&recording]);
    assert!(verified.status.success(), "{}", String::from_utf8_lossy(&verified.stderr));
    let printed = String::from_utf8(rrd(&viewer, "print", &[&recording]).stdout).unwrap();
    let [stops, tries] = ["run/iterations.csv", "run/probings.csv"].map(|name| data_rows(&run().join(name)));
    // One chunk on the timelines that count stops, one on the timeline that counts probings.
    for entity in [
        r"/world/arm\ true/base",
        r"/world/arm\ true/link\ 6",
        r"/world/arm\ identified/link\ 6",
        r"/world/arm\ drawn/link\ 6",
        "/world/tool",
        r"/world/tool/plunger\ 1",
        r"/world/tool/plunger\ 2",
        r"/world/tool/plunger\ 3",
        "/centring/path/now/line",
        "/centring/balls/now/line",
        r"/centring/readings/now/axis\ 3/line",
    ] {
        let mut found = rows(&printed, entity);
        // Drops the static appearance of a plunger.
        found.retain(|&count| count > 1);
        assert_eq!(found, [tries, stops], "{entity}");
    }
    // The same, plus the appearance of the lines.
    for entity in [r"/readings/axis\ 1\ um", r"/readings/axis\ 2\ um", r"/readings/axis\ 3\ um", r"/readings/band\ \+3\ um"] {
        assert_eq!(rows(&printed, entity), [1, tries, stops], "{entity}");
    }
    for entity in [
        "/story",
        "/world/cell/table",
        r"/world/cell/riser\ 3",
        "/world/balls/4",
        r"/world/tracker\ points/validation",
        r"/world/residuals/step\ 1/before",
        r"/world/residuals/step\ 1/after",
        "/centring/balls/2/all",
    ] {
        assert_eq!(rows(&printed, entity), [1], "{entity}");
    }
    let stats = String::from_utf8(rrd(&viewer, "stats", &[&recording]).stdout).unwrap();
    let longest = stats.lines().find_map(|l| l.strip_prefix("num_rows_max = ")).unwrap().replace(' ', "");
    assert_eq!(longest.parse::<usize>().unwrap(), stops, "something is recorded more often than the arm stops");
    assert!(!stats.lines().any(|l| l.starts_with("log_t")), "the clock of the computer is in the recording");
    for timeline in ["iteration", "probing", "time"] {
        assert!(stats.lines().any(|l| l.starts_with(&format!("{timeline}: "))), "no timeline {timeline}");
    }
}

#[test]
fn the_journal_of_a_real_cell_is_replayed_without_its_truth() {
    let Some(viewer) = viewer() else { return };
    // The output of a real session: its samples and its journal; no scene, no result, and no true postures of the arm.
    let session = tempfile::tempdir().unwrap();
    let run = run().join("run");
    let dataset = fs::read_dir(run.join("trical")).unwrap().map(|file| file.unwrap().path());
    for from in dataset.chain(["iterations.csv", "probings.csv"].map(|name| run.join(name))) {
        fs::copy(&from, session.path().join(from.file_name().unwrap())).unwrap();
    }
    let recording = session.path().join("run.rrd");
    let output = view(&[session.path()]);
    let left_out = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && left_out.contains("scene.toml"), "{left_out}");
    assert!(rrd(&viewer, "verify", &[&recording]).status.success());
    let printed = String::from_utf8(rrd(&viewer, "print", &[&recording]).stdout).unwrap();
    let [stops, tries] = ["iterations.csv", "probings.csv"].map(|name| data_rows(&session.path().join(name)));
    for entity in [r"/world/arm\ identified/link\ 6", r"/world/arm\ drawn/link\ 6", "/world/tool", "/centring/path/now/line"] {
        assert_eq!(rows(&printed, entity), [tries, stops], "{entity}");
    }
    assert!(!printed.contains(r"/world/arm\ true"), "a truth that nobody knows is shown");
}

#[test]
fn a_recording_cut_short_is_not_verified() {
    let Some(viewer) = viewer() else { return };
    let recording = run().join("cut.rrd");
    record(&run().join("run"), &recording);
    let bytes = fs::read(&recording).unwrap();
    fs::write(&recording, &bytes[..bytes.len() / 2]).unwrap();
    assert!(!rrd(&viewer, "verify", &[&recording]).status.success());
}

#[test]
fn the_same_run_gives_the_same_recording_and_another_another() {
    let Some(viewer) = viewer() else { return };
    let [first, second, other] = ["first.rrd", "second.rrd", "other.rrd"].map(|name| run().join(name));
    record(&run().join("run"), &first);
    record(&run().join("run"), &second);
    assert!(rrd(&viewer, "compare", &[&first, &second]).status.success());
    let another = make_run("gear-ripple", "2");
    record(&another.path().join("run"), &other);
    assert!(!rrd(&viewer, "compare", &[&first, &other]).status.success());
}

#[test]
fn the_ladder_shows_its_rungs() {
    let Some(viewer) = viewer() else { return };
    let recording = run().join("ladder.rrd");
    let output = view(&[&run().join("run"), Path::new("--ladder"), Path::new("-o"), &recording]);
    assert!(output.status.success());
    let printed = String::from_utf8(rrd(&viewer, "print", &[&recording]).stdout).unwrap();
    // The calibration, and the ripple hidden by the scenario, which is the recommended model.
    for (step, pieces) in [(1, 1), (2, 1), (3, 0)] {
        for side in ["before", "after"] {
            assert_eq!(rows(&printed, &format!(r"/world/residuals/step\ {step}/{side}")).len(), pieces, "{step} {side}");
        }
    }
}
