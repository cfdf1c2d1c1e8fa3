//! A zero that was lost is the first sentence of every verb that fits, with the number to enter in the mastering; and a tracker that
//! was bumped is found in the order of the rows where nobody wrote down the time, as a supposition.

use std::fs;
use std::path::Path;

use crate::program::{calibench, done, json};

/// A case in a folder of its own.
fn case(name: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/cases").join(name);
    fs::create_dir(folder.path().join("data")).unwrap();
    for file in fs::read_dir(from).unwrap().map(|entry| entry.unwrap()) {
        fs::copy(file.path(), folder.path().join("data").join(file.file_name())).unwrap();
    }
    folder
}

const FIRST: &str = "Joint 3's zero is off by +1.49 deg";

#[test]
fn a_lost_zero_is_the_first_sentence_everywhere() {
    let folder = case("lost-zero-tracker");
    let at = folder.path();
    for verb in [&["identify", "data", "-o", "c.toml"][..], &["compare", "c.toml", "data"], &["diagnose", "data"]] {
        let said = done(at, verb);
        assert!(said.starts_with(FIRST) && said.contains("enter -1.49 deg in the mastering"), "{verb:?}: {said}");
        assert!(!said.contains("nothing is to be added; what remains is noise"), "{verb:?}: {said}");
    }
    let report = done(at, &["report", "data", "-o", "report.html"]);
    assert!(report.starts_with(FIRST), "{report}");
    let document = json(at, &["diagnose", "data", "--json"]);
    assert!(document["sentences"][0].as_str().unwrap().starts_with(FIRST));
}

#[test]
fn a_bumped_tracker_is_found_in_the_order_of_the_rows() {
    let folder = case("bumped-tracker");
    let said = done(folder.path(), &["diagnose", "data"]);
    let supposed = said.lines().find(|line| line.starts_with("Supposing that the rows stand")).unwrap_or_default();
    assert!(supposed.contains("between samples s26 and s27"), "{said}");
    assert!(!said.contains("state the noise as it is") && said.contains("Next: give the rows their times"), "{said}");
    // With times it is a finding like any other.
    let samples = folder.path().join("data/samples.csv");
    let text = fs::read_to_string(&samples).unwrap();
    let timed = text.lines().enumerate().map(|(k, line)| match k {
        0 => format!("{line},time_s\n"),
        k => format!("{line},{}\n", 30 * (k - 1)),
    });
    fs::write(&samples, timed.collect::<String>()).unwrap();
    let said = calibench(folder.path(), &["diagnose", "data"]);
    let said = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(!said.contains("Supposing") && said.contains("between samples s26 and s27"), "{said}");
}
