//! Checks that are added to one history at the same time are all kept.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use crate::program::scenario;

/// A short plan in the cell of table 8.
const SCENARIO: &str = "format = \"calibench-scenario/1\"\nextends = \"BASE\"\n[plan]\npool_per_ball = 150\nstarts = 1\n";

/// Number of checks.
const CHECKS: usize = 6;

fn begun(folder: &Path, line: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).args(line.split(' ')).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits for the end, which must be one of a check that was made, whatever it found.
#[track_caller]
fn ended(child: Child) {
    let output = child.wait_with_output().unwrap();
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn checks_made_at_once_are_all_in_the_history() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // Backslashes in a path would be escapes.
    let base = scenario("table8.toml").replace('\\', "/");
    fs::write(at.join("cell.toml"), SCENARIO.replace("BASE", &base)).unwrap();
    for line in [
        "plan cell.toml -o plan.toml",
        "measure cell.toml --plan plan.toml -o then",
        "identify then -o calibration.toml",
        "keep check calibration.toml --then then --plan plan.toml -o sentinels.toml",
    ] {
        ended(begun(at, line));
    }
    let check = "keep check calibration.toml --then then";
    for visit in 1..=CHECKS {
        ended(begun(at, &format!("{check} --cell cell.toml --plan sentinels.toml --visit {visit} -o now{visit}")));
    }
    // A killed check left its lock behind.
    fs::write(at.join(".history.toml.lock"), "").unwrap();
    let add = |visit: usize| begun(at, &format!("{check} now{visit} --history history.toml --on 2025-12-01"));
    let all: Vec<Child> = (1..=CHECKS).map(add).collect();
    all.into_iter().for_each(ended);
    let history = fs::read_to_string(at.join("history.toml")).unwrap();
    for visit in 1..=CHECKS {
        assert_eq!(history.matches(&format!("dataset = \"now{visit}\"")).count(), 1, "{history}");
    }
    assert_eq!(history.matches("[[check]]").count(), CHECKS, "{history}");
    assert_eq!(at.join(".history.toml.lock").exists(), cfg!(not(unix)), "no lock is left");
}
