//! What is judged is compared by its type: a name that changes would be compared in vain, and a key that is wrong would pass for
//! an answer that is wrong.

use crate::{production, sources};

/// The sources that compare answers with the truth.
const JUDGES: [&str; 2] = ["sim/src/ground_truth.rs", "sim/lab/src/suite"];

/// Comparisons by name, and values that stand in for an error.
const REFUSED: [&str; 4] = [".name() ==", ".name() !=", ".name(), \"", "unwrap_or_default"];

/// Lines of a judge that compare by name or replace an error.
fn by_text(source: &str) -> impl Iterator<Item = &str> {
    production(source).filter(|line| REFUSED.iter().any(|text| line.contains(text)))
}

#[test]
fn judges_compare_no_names_and_replace_no_errors() {
    for judge in JUDGES {
        let files = sources(judge);
        assert!(!files.is_empty(), "{judge} has moved: name its new place here");
        for (path, source) in files {
            let lines: Vec<&str> = by_text(&source).collect();
            assert!(lines.is_empty(), "{path}: compare the enum, and hand the error on: {lines:#?}");
        }
    }
}

#[test]
fn a_comparison_by_name_is_found() {
    let source = "a.name() == \"b\"\nmatches!(v.name(), \"partly\" | \"several\")\n// x.name() ==\n#[cfg(test)]\nmod tests { x.unwrap_or_default() }";
    assert_eq!(by_text(source).count(), 2);
}
