//! `docs/hunting-a-missing-effect.md` shows the program's output: its commands run, in the order of the page, and print what it
//! shows.
//!
//! `CALIBENCH_WRITE_HUNT=1 cargo test --package calibench-cli hunting_tells_the_truth` writes what the program says now into the page.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use crate::oracles;

const HOW_TO_REFRESH: &str = "refresh with `CALIBENCH_WRITE_HUNT=1 cargo test --package calibench-cli hunting_tells_the_truth`";

/// Number of table cells that fit on the page.
const CELLS: usize = 7;

/// Number of columns of the page.
const WIDTH: usize = 120;

/// Both hunts write the same page.
static PAGE: Mutex<()> = Mutex::new(());

/// The part of a command's output shown on the page: lines that begin so.
type Shown = (&'static str, &'static [&'static str]);

const STEP_LINES: [&str; 5] = ["│ model", "│ base_frame", "│ + ", "Added", "Against"];

const RIPPLE: [(&str, &[Shown]); 5] = [
    (
        "ripple: run",
        &[("run scenarios/gear-ripple.toml --out runs/ripple", &["│ position error, mm          ┆", "│ nominal", "│ TriCal"])],
    ),
    (
        "ripple: compare",
        &[(
            "compare runs/ripple/trical.toml runs/ripple/trical",
            &["* Noise left", "* The calibration was", "* Joint", "Next"],
        )],
    ),
    (
        "ripple: diagnose",
        &[(
            "diagnose runs/ripple/trical",
            &["Residual of", "Verdict", "Saw", "Means", "Do", "Verify", "If nothing", "Expected", "Next"],
        )],
    ),
    (
        "ripple: add",
        &[(
            "add harmonic:3:202 runs/ripple/trical -o runs/ripple-model.toml",
            &[STEP_LINES[0], STEP_LINES[1], STEP_LINES[2], STEP_LINES[3], "│ parameter", "│ harmonic"],
        )],
    ),
    (
        "ripple: prove",
        &[
            ("identify runs/ripple/trical --model runs/ripple-model.toml -o runs/ripple/after.toml", &[]),
            ("validate runs/ripple/trical.toml runs/ripple/validation", &["│ position error", "│ measured, held out"]),
            ("validate runs/ripple/after.toml runs/ripple/validation", &["│ position error", "│ measured, held out"]),
            ("ladder runs/ripple/trical", &[STEP_LINES[0], STEP_LINES[1], STEP_LINES[2], "The ladder", "Use"]),
        ],
    ),
];

const UR10: [(&str, &[Shown]); 5] = [
    (
        "ur10: import",
        &[
            ("import ur10-ipa $DATA/ur10-ipa/Series_A/measurements_grid.csv -o A", &["11911 samples"]),
            (
                "import ur10-ipa $DATA/ur10-ipa/Series_B/measurements_joint_configurations.csv -o B --holdout 0.9666",
                &["1495 samples"],
            ),
        ],
    ),
    (
        "ur10: diagnose",
        &[(
            "diagnose A",
            &["Residual of", "Verdict", "Saw", "Means", "Do", "Verify", "If nothing", "Next", "│ effect  ", "│ harmonic:"],
        )],
    ),
    (
        "ur10: add",
        &[
            ("add harmonic:2:17 A --check B -o model.toml", &STEP_LINES),
            ("add harmonic:1:17 A --model model.toml --check B", &STEP_LINES),
            ("add harmonic:3:17 A --model model.toml --check B", &STEP_LINES),
        ],
    ),
    (
        "ur10: curves",
        &[
            ("identify A -o plain.toml", &[]),
            ("validate plain.toml B", &["│ position error", "│ orientation error", "│ measured, held out", "│ 1448"]),
            ("identify A --model curves.toml -o curved.toml", &[]),
            ("validate curved.toml B", &["│ position error", "│ orientation error", "│ measured, held out", "│ 1448"]),
        ],
    ),
    ("ur10: compare", &[("compare curved.toml B --validation", &["* Sample", "* Each of these"])]),
];

fn page() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/hunting-a-missing-effect.md")
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Standard output of the program; a refused step is not a failure.
fn said(command: &str, folder: &Path, data: Option<&Path>) -> String {
    let arguments = command.split(' ').map(|word| match (word.strip_prefix("$DATA/"), data) {
        (Some(file), Some(data)) => data.join(file).into_os_string(),
        _ => word.into(),
    });
    let mut program = Command::new(env!("CARGO_BIN_EXE_calibench"));
    let output = program.args(arguments).current_dir(folder).output().expect("the program starts");
    let refused = command.starts_with("add ") && output.status.code() == Some(1);
    assert!(output.status.success() || refused, "calibench {command}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it prints text")
}

/// The first cells of a row; a sentence wrapped at words.
fn laid_out(line: &str, out: &mut String) {
    if line.starts_with('│') {
        let cells: Vec<&str> = line.trim_matches('│').split('┆').take(CELLS).collect();
        let _ = writeln!(out, "│{}│", cells.join("┆"));
        return;
    }
    let mut width = 0;
    for word in line.split(' ') {
        let length = word.chars().count();
        if width > 0 && width + 1 + length > WIDTH {
            out.push_str("\n  ");
            width = 2;
        } else if width > 0 {
            out.push(' ');
            width += 1;
        }
        out.push_str(word);
        width += length;
    }
    out.push('\n');
}

fn block(commands: &[Shown], folder: &Path, data: Option<&Path>) -> String {
    let mut out = String::from("```text\n");
    for (command, beginnings) in commands {
        let _ = writeln!(out, "$ calibench {command}");
        let said = said(command, folder, data);
        for beginning in beginnings.iter().filter(|b| !STEP_LINES.contains(b)) {
            assert!(
                said.lines().any(|line| line.starts_with(beginning)),
                "calibench {command}: no line '{beginning}...'\n{said}"
            );
        }
        said.lines().filter(|line| beginnings.iter().any(|b| line.starts_with(b))).for_each(|line| laid_out(line, &mut out));
    }
    out.push_str("```\n");
    out
}

/// The text up to the end of the marker's line, the text between the markers, and the rest from the end marker on.
fn around<'a>(text: &'a str, name: &str) -> (&'a str, &'a str, &'a str) {
    let marker = format!("<!-- {name} -->");
    let start = text.find(&marker).unwrap_or_else(|| panic!("the page has no place for {name}"));
    let from = start + text[start..].find('\n').expect("the marker's line ends") + 1;
    let to = from + text[from..].find("<!-- end -->").expect("the place ends");
    (&text[..from], &text[from..to], &text[to..])
}

/// Compares the page with the program's output, or writes the output into it.
fn hold(name: &str, now: &str) {
    let _alone = PAGE.lock();
    let text = read(&page());
    let (before, shown, after) = around(&text, name);
    if std::env::var_os("CALIBENCH_WRITE_HUNT").is_some() {
        std::fs::write(page(), format!("{before}{now}{after}")).expect("the page can be written");
    } else if let Err(difference) = same_as_printed(shown, now) {
        panic!("{name}: {difference}; {HOW_TO_REFRESH}. It is now\n{now}");
    }
}

/// The same words and, within two units of their last printed place, the same numbers: a sine may round differently on another
/// machine.
fn same_as_printed(shown: &str, now: &str) -> Result<(), String> {
    let words = |text: &str| -> Vec<String> { text.split_whitespace().map(str::to_owned).collect() };
    let (shown, now) = (words(shown), words(now));
    if shown.len() != now.len() {
        return Err(format!("it has {} words in place of {}", shown.len(), now.len()));
    }
    let same = |s: &str, n: &str| match (number(s), number(n)) {
        (Some((s, place)), Some((n, _))) => (s - n).abs() < 2.5 * place,
        _ => s == n,
    };
    shown.iter().zip(&now).find(|(s, n)| !same(s, n)).map_or(Ok(()), |(s, n)| Err(format!("it shows '{s}' in place of '{n}'")))
}

/// A printed number and one unit of its last place.
fn number(word: &str) -> Option<(f64, f64)> {
    let word = word.trim_matches(|c: char| ",;:()%.".contains(c));
    let value = word.parse::<f64>().ok().filter(|v| v.is_finite())?;
    let (mantissa, exponent) = word.split_once('e').unwrap_or((word, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, d)| d.len() as i32);
    Some((value, 10f64.powi(exponent.parse::<i32>().ok()? - decimals)))
}

#[test]
fn the_simulated_robot() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir(folder.path().join("scenarios")).expect("writable");
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    for file in std::fs::read_dir(scenarios).expect("there are scenarios") {
        let file = file.expect("readable");
        if file.path().is_dir() {
            continue;
        }
        std::fs::copy(file.path(), folder.path().join("scenarios").join(file.file_name())).expect("writable");
    }
    for (name, commands) in RIPPLE {
        hold(name, &block(commands, folder.path(), None));
    }
    let truth = read(&folder.path().join("scenarios/gear-ripple.toml"));
    assert!(truth.contains("sin_urad = 160.0") && truth.contains("cos_urad = -120.0"), "what the page says was hidden");
}

#[test]
fn the_measured_robot() {
    let data = oracles::data("ur10-ipa").canonicalize().expect("it is there");
    let data = data.parent().expect("it is among the public data");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = read(&page());
    let model = text.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("the page shows curves.toml");
    std::fs::write(folder.path().join("curves.toml"), model).expect("writable");
    let mut shown = String::new();
    for (name, commands) in UR10 {
        let block = block(commands, folder.path(), Some(data));
        hold(name, &block);
        shown += &block;
    }
    hold("ur10: where", &first_joint(folder.path()));
    hold("ur10: fall", &fall(&shown));
}

/// The falling error: every step taken, and the curves, extracted from the tables above.
fn fall(shown: &str) -> String {
    let cells = |row: &str| -> Vec<String> { row.trim_matches('│').split('┆').map(|c| c.trim().to_owned()).collect() };
    let mut table = String::from("| model | A, blocks left out, rms mm | B, robot of A, rms mm |\n|---|---|---|\n");
    let mut row = |cells: &[&str]| _ = writeln!(table, "| {} |", cells.join(" | "));
    for step in shown.split("$ calibench add ").skip(1) {
        let steps: Vec<Vec<String>> =
            step.lines().filter(|line| line.starts_with("│ base_frame") || line.starts_with("│ + ")).map(cells).collect();
        let [below, above] = &steps[..] else { panic!("a step has two steps: {step}") };
        if !below[0].contains("harmonic") {
            row(&[&below[0], &below[2], &below[4]]);
        }
        let refused = if step.contains("Added.") { "" } else { " (refused)" };
        row(&[&format!("{}{refused}", above[0]), &above[2], &above[4]]);
    }
    let curved = shown
        .split("validate curved.toml B")
        .nth(1)
        .and_then(|s| s.lines().find(|line| line.starts_with("│ measured, held out")));
    row(&["the first, + error_curve:1 ... error_curve:5", "", &cells(curved.expect("the curves are judged"))[4]]);
    table
}

/// Histogram of the first joint's angle in either campaign.
fn first_joint(folder: &Path) -> String {
    let angles = |dataset: &str| {
        let dataset = calibench::measure::dataset::file::read_dataset(&folder.join(dataset)).unwrap_or_else(|e| panic!("{e}"));
        dataset.samples.iter().map(|s| s.q[0].to_degrees()).collect::<Vec<f64>>()
    };
    let (a, b) = (angles("A"), angles("B"));
    let mut table = String::from("| first joint, deg | poses of A | poses of B |\n|---|---|---|\n");
    for from in (-180..40).step_by(20) {
        let count = |all: &[f64]| all.iter().filter(|q| (f64::from(from)..f64::from(from + 20)).contains(*q)).count();
        let _ = writeln!(table, "| {from} to {} | {} | {} |", from + 20, count(&a), count(&b));
    }
    table
}

/// The prose leaves decimals to the program's output, which is verified.
#[test]
fn its_prose_measures_nothing() {
    let text = read(&page());
    let blocks = RIPPLE.iter().chain(&UR10).map(|(name, _)| *name).chain(["ur10: where", "ur10: fall"]);
    let prose = blocks.fold(text, |text, name| {
        let (before, shown, after) = around(&text, name);
        assert!(!shown.is_empty(), "{name} shows nothing; {HOW_TO_REFRESH}");
        format!("{before}{after}")
    });
    let decimal = |w: &&str| w.trim_matches('.').contains('.') && w.chars().any(|c| c.is_ascii_digit());
    let found: Vec<&str> = prose.split(|c: char| !c.is_ascii_digit() && c != '.').filter(decimal).collect();
    assert!(found.is_empty(), "nothing checks these numbers: {found:?}");
}
