//! What is printed fits the terminal, and says the same as what is printed without one.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

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

#[test]
fn eighty_columns_hold_everything() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/table8.toml");
    let scenario = scenario.to_str().unwrap();
    printed(folder, None, &["run", scenario, "--out", "run"]);
    for arguments in [
        &["identify", "run/trical"][..],
        &["validate", "run/trical.toml", "run/validation"],
        &["compare", "run/trical.toml", "run/trical"],
        &["diagnose", "run/trical", "--heat-map"],
        &["add", "harmonic1:1", "run/trical", "--force", "-o", "model.toml"],
        &["ladder", "run/trical"],
        &["next", "run/trical"],
        &["prove", "run/trical", "--effect", "joint_scale", "--nothing", "0"],
        &["effects"],
        &["robots"],
    ] {
        let whole = printed(folder, None, arguments);
        assert_eq!(printed(folder, Some("80"), &[arguments, &["--wide"]].concat()), whole, "{arguments:?}");
        let fitted = printed(folder, Some("80"), arguments);
        let widest = fitted.lines().max_by_key(|line| line.chars().count()).unwrap_or_default();
        assert!(widest.chars().count() <= 80, "{arguments:?}: {widest}");
        // The names of columns that are empty throughout are no news.
        let mut lines = whole.lines();
        let mut rows: Vec<&str> = Vec::new();
        while let Some(line) = lines.next() {
            rows.push(line);
            if line.starts_with('┌') {
                lines.next();
            }
        }
        let (expected, found) = (words(&rows.join("\n")), words(&fitted));
        for word in expected.keys() {
            assert!(found.get(word).is_some_and(|n| *n >= 1), "{arguments:?}: {word} is lost");
        }
        assert!(!fitted.contains('\u{1b}'), "{arguments:?}");
    }
}
