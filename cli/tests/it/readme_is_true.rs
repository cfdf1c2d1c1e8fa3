//! README and the pages that it leads to are correct: tables and verbs match the program. What they tell a user to type is run by
//! `every_command_on_the_pages_runs`; links and the tree of the repository are checked by `calibench-house`.
//!
//! `CALIBENCH_WRITE_README=1 cargo test --package calibench-cli readme_is_true` writes the present tables into the page of the
//! validation.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Mutex;

use serde_json::Value;

const HOW_TO_REFRESH: &str = "refresh with `CALIBENCH_WRITE_README=1 cargo test --package calibench-cli readme_is_true`";

/// The page that compares with the paper and with real robots.
const VALIDATION: &str = "docs/validation.md";

/// The page of all verbs.
const VERBS: &str = "docs/verbs.md";

/// Concurrent tests write the same page.
static PAGE: Mutex<()> = Mutex::new(());

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the workspace is there")
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

fn program(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calibench")).args(arguments).current_dir(folder).output().expect("the program starts")
}

fn help(arguments: &[&str]) -> String {
    String::from_utf8(program(arguments, &root()).stdout).expect("help is text")
}

#[test]
fn its_table_9_is_that_of_a_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("paper");
    let output = program(&["run", "scenarios/paper.toml", "--out", &out.to_string_lossy()], &root());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let result = std::fs::read_to_string(out.join("result.json")).expect("the run was kept");
    let result: Value = serde_json::from_str(&result).expect("the result is JSON");
    let now = table_9(&result);
    if is_to_be_written("table 9", &now) {
        return;
    }
    let text = read(VALIDATION);
    let (_, shown, _) = around(&text, "table 9");
    if let Err(difference) = same_as_printed(shown, &now) {
        panic!("{VALIDATION}, table 9: {difference}; {HOW_TO_REFRESH}. It is now\n{now}");
    }
}

/// Writes the block into the page of the validation if requested.
fn is_to_be_written(name: &str, now: &str) -> bool {
    let asked = std::env::var_os("CALIBENCH_WRITE_README").is_some();
    if asked {
        let _alone = PAGE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let text = read(VALIDATION);
        let (before, _, after) = around(&text, name);
        std::fs::write(root().join(VALIDATION), format!("{before}{now}{after}")).expect("the page can be written");
    }
    asked
}

/// The measurement by `docs/robots/make` takes half an hour and public data; comparing the page with its result takes neither.
#[test]
fn its_public_robots_are_those_of_the_table() {
    let table = read("docs/robots/table.md");
    let (head, _) = table.split_once("## All divisions\n").expect("the table has a head");
    if !is_to_be_written("public robots", head) {
        let text = read(VALIDATION);
        let (_, shown, _) = around(&text, "public robots");
        assert_eq!(shown, head, "{VALIDATION} (left) and docs/robots/table.md (right); {HOW_TO_REFRESH}");
    }
}

/// The text up to the end of the marker's line, the text between the markers, and the rest from the end marker on.
fn around<'a>(text: &'a str, name: &str) -> (&'a str, &'a str, &'a str) {
    let marker = format!("<!-- {name}:");
    let start = text.find(&marker).unwrap_or_else(|| panic!("the page has no place for the {name}"));
    let from = start + text[start..].find('\n').expect("the marker's line ends") + 1;
    let to = from + text[from..].find("<!-- end -->").expect("the place ends");
    (&text[..from], &text[from..to], &text[to..])
}

/// The paper's Table 9 beside that of the run.
fn table_9(result: &Value) -> String {
    let poses = &result["methods"][0]["validation"]["samples"];
    let row = |name: &str, numbers: &Value| {
        let mm = |key: &str| format!("{:.3}", numbers[key].as_f64().unwrap_or(f64::NAN));
        format!("| {name} | {} | {} | {} |\n", mm("mean_mm"), mm("max_mm"), mm("std_mm"))
    };
    let mut table =
        format!("| position error on {poses} poses, mm | mean | maximum | standard deviation |\n|---|---|---|---|\n");
    for (method, title) in [("trical", "TriCal"), ("tracker", "laser tracker")] {
        let measured = result["methods"].as_array().and_then(|all| all.iter().find(|m| m["name"] == method));
        let measured = measured.unwrap_or_else(|| panic!("the run has no method {method}"));
        table += &row(&format!("calibrated by {title}, the paper"), &result["paper"][method]);
        table += &row(&format!("calibrated by {title}, the simulated cell"), &measured["validation"]);
    }
    table
}

/// The same words and, within one unit of their last printed place, the same numbers: a sine may round differently on another
/// machine.
fn same_as_printed(shown: &str, now: &str) -> Result<(), String> {
    let words = |text: &str| -> Vec<String> { text.split_whitespace().map(str::to_owned).collect() };
    let (shown, now) = (words(shown), words(now));
    if shown.len() != now.len() {
        return Err(format!("it has {} words in place of {}", shown.len(), now.len()));
    }
    for (s, n) in shown.iter().zip(&now) {
        let close = match (number(s), number(n)) {
            (Some((s, place)), Some((n, _))) => (s - n).abs() < 1.5 * place,
            _ => s == n || s.chars().all(|c| c == '█'),
        };
        if !close {
            return Err(format!("it shows '{s}' in place of '{n}'"));
        }
    }
    Ok(())
}

/// A printed number and one unit of its last place.
fn number(word: &str) -> Option<(f64, f64)> {
    let word = word.trim_matches(|c: char| ",;()%".contains(c));
    let value = word.parse::<f64>().ok().filter(|v| v.is_finite())?;
    let (mantissa, exponent) = word.split_once('e').unwrap_or((word, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, d)| d.len() as i32);
    Some((value, 10f64.powi(exponent.parse::<i32>().ok()? - decimals)))
}

#[test]
fn numbers_are_compared_to_their_last_place() {
    assert_eq!(same_as_printed("mean 0.326, rank 31", "mean 0.327, rank 31"), Ok(()));
    assert!(same_as_printed("mean 0.326", "mean 0.328").is_err());
    assert!(same_as_printed("O2 7.25e-4,", "O2 7.27e-4,").is_err());
    assert!(same_as_printed("mean 0.326", "max 0.326").is_err());
}

/// A row of the table of verbs.
struct VerbRow {
    /// The verb, with the group that it is in.
    verb: String,
    /// The arguments that it takes.
    arguments: Vec<String>,
    row: String,
}

fn verb_rows() -> Vec<VerbRow> {
    let text = read(VERBS);
    text.lines()
        .skip_while(|line| !line.starts_with("| verb |"))
        .skip(2)
        .take_while(|line| line.starts_with("| `"))
        .map(|row| {
            let first = row.split('`').nth(1).unwrap_or_default();
            let (verb, arguments): (Vec<&str>, Vec<&str>) =
                first.split_whitespace().partition(|word| word.starts_with(|c: char| c.is_ascii_lowercase()));
            let arguments = arguments.into_iter().map(str::to_owned).collect();
            VerbRow { verb: verb.join(" "), arguments, row: row.to_owned() }
        })
        .collect()
}

/// The help of a verb, named with the group that it is in.
fn help_of(verb: &str) -> String {
    let words: Vec<&str> = verb.split(' ').chain(["--help"]).collect();
    help(&words)
}

/// The verbs that a help lists, under its headings and before its options: each begins two columns in.
fn listed(help: &str) -> Vec<String> {
    help.lines()
        .take_while(|line| *line != "Options:")
        .filter_map(|line| line.strip_prefix("  "))
        .filter(|line| !line.starts_with(' '))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|verb| *verb != "help")
        .map(str::to_owned)
        .collect()
}

/// Groups: what is in them are verbs.
const GROUPS: [&str; 4] = ["cell", "effects", "keep", "sim"];

#[test]
fn its_verbs_are_those_of_the_program() {
    let of_groups = GROUPS.into_iter().chain(["plan"]).flat_map(|group| {
        let inner = listed(help_of(group).split("Commands:").nth(1).unwrap_or_default());
        inner.into_iter().filter(|verb| verb.starts_with(char::is_alphabetic)).map(move |verb| format!("{group} {verb}"))
    });
    let at_the_top = listed(&help(&["--help"])).into_iter().filter(|verb| !GROUPS.contains(&verb.as_str()));
    let known: BTreeSet<String> = at_the_top.chain(of_groups).collect();
    let rows = verb_rows();
    let told: BTreeSet<String> = rows.iter().map(|row| row.verb.clone()).collect();
    assert_eq!(told, known, "verbs of the page (left) and of the program (right)");
    for VerbRow { verb, arguments, row } in &rows {
        let help = help_of(verb);
        let usage = help.lines().find(|line| line.starts_with("Usage:")).unwrap_or_default();
        for argument in arguments {
            let name = argument.trim_end_matches("...").trim_end_matches('S');
            let taken = ["<", "["].iter().any(|open| usage.contains(&format!("{open}{name}")));
            assert!(taken, "{VERBS}: `{verb}` takes no {name}; {usage}");
        }
        for flag in row.split('`').filter(|quoted| quoted.starts_with("--")) {
            assert!(help.contains(flag), "{VERBS}: `{verb}` has no {flag}");
        }
    }
    for line in read(VERBS).lines().filter(|line| line.starts_with("`--json` on ")) {
        for verb in line.split(" prints").next().unwrap_or_default().split('`').skip(3).step_by(2) {
            assert!(help_of(verb).contains("--json"), "{VERBS}: `{verb}` has no --json");
        }
    }
}
