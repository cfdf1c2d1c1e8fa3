//! Output fits the terminal, and says the same as without one, except for columns that it names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use crate::program::run_of;

fn printed(folder: &Path, columns: Option<&str>, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).args(arguments).env_remove("COLUMNS");
    if let Some(columns) = columns {
        command.env("COLUMNS", columns);
    }
    let output = command.output().unwrap();
    assert!(output.status.code() != Some(2), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Every word with the number of times it occurs, without the frames of tables and the colons of lists. Names of columns are
/// repeated in lists.
fn words(text: &str) -> BTreeMap<String, usize> {
    let mut words = BTreeMap::new();
    let plain = |c: char| c.is_whitespace() || "│┆┌┐└┘├┤╞╪╡═─┬┴┼;:".contains(c);
    for word in text.split(plain).filter(|word| !word.is_empty()) {
        *words.entry(word.to_owned()).or_insert(0) += 1;
    }
    words
}

/// The names of the columns that were left out, as said below their tables.
fn left_out(fitted: &str) -> BTreeSet<String> {
    let joined = fitted.replace("\n  ", " ");
    let said = joined.lines().filter_map(|line| line.strip_prefix("not shown: ")?.strip_suffix("; --wide shows all"));
    said.flat_map(|names| names.split(", ").map(str::to_owned).collect::<Vec<_>>()).collect()
}

/// The text without these columns of its tables, and without the headers: a list does not name columns that are empty.
fn without_columns(whole: &str, names: &BTreeSet<String>) -> String {
    let mut out = String::new();
    let mut kept: Vec<bool> = Vec::new();
    let mut header = false;
    for line in whole.lines() {
        if line.starts_with('┌') {
            header = true;
            continue;
        }
        if !line.starts_with('│') {
            out.push_str(&format!("{line}\n"));
            continue;
        }
        let cells: Vec<&str> = line.trim_matches('│').split('┆').map(str::trim).collect();
        if header {
            // A name with a comma in it is said as two.
            let is_left_out = |cell: &&str| names.contains(*cell) || cell.split(", ").all(|part| names.contains(part));
            kept = cells.iter().map(|cell| !is_left_out(cell)).collect();
            header = false;
        } else {
            let cells = cells.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(cell, _)| *cell);
            out.push_str(&format!("{}\n", cells.collect::<Vec<_>>().join(" ")));
        }
    }
    out
}

#[test]
fn eighty_columns_hold_everything_or_say_what_they_leave_out() {
    let folder = run_of("table8.toml");
    let folder = folder.path();
    for arguments in [
        &["identify", "run/trical"][..],
        &["validate", "run/trical.toml", "run/validation"],
        &["compare", "run/trical.toml", "run/trical"],
        &["diagnose", "run/trical", "--heat-map"],
        &["add", "harmonic1:1", "run/trical", "--force", "-o", "model.toml"],
        &["ladder", "run/trical"],
        &["plan", "next", "run/trical"],
        &["effects", "prove", "run/trical", "--effect", "joint_scale", "--nothing", "0"],
        &["effects"],
        &["robots"],
    ] {
        let whole = printed(folder, None, arguments);
        assert_eq!(printed(folder, Some("80"), &[arguments, &["--wide"]].concat()), whole, "{arguments:?}");
        let fitted = printed(folder, Some("80"), arguments);
        let widest = fitted.lines().max_by_key(|line| line.chars().count()).unwrap_or_default();
        assert!(widest.chars().count() <= 80, "{arguments:?}: {widest}");
        let left_out = left_out(&fitted);
        let rows = without_columns(&whole, &left_out);
        let (expected, found) = (words(&rows), words(&fitted));
        for word in expected.keys() {
            assert!(found.get(word).is_some_and(|n| *n >= 1), "{arguments:?}: {word} is lost");
        }
        assert!(!fitted.contains('\u{1b}'), "{arguments:?}");
    }
}
