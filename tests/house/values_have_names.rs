//! What travels together is a type with names: a tuple in a signature leaves it to its reader which place holds what.

use crate::{production, sources};

/// Where Rust sources are.
const PLACES: [&str; 9] = ["src", "report", "sim", "cli", "web/src", "tests/it", "tests/fuzz", "examples", "benches"];

/// A dataset with its name as a tuple.
const NAMELESS: [&str; 2] = ["(&str, &Dataset)", "(&'a str, &'a Dataset)"];

/// Lines that hold a dataset and its name in a tuple.
fn nameless(source: &str) -> impl Iterator<Item = &str> {
    production(source).filter(|line| NAMELESS.iter().any(|text| line.contains(text)))
}

#[test]
fn a_dataset_and_its_name_are_a_named_dataset() {
    for (path, source) in PLACES.into_iter().flat_map(sources) {
        let lines: Vec<&str> = nameless(&source).collect();
        assert!(lines.is_empty(), "{path}: write `NamedDataset`: {lines:#?}");
    }
}

#[test]
fn a_tuple_of_a_dataset_is_found() {
    assert_eq!(nameless("fn f(d: &[(&str, &Dataset)]) {}\nfn g(d: &[NamedDataset<'_>]) {}\n// (&str, &Dataset)").count(), 1);
}
