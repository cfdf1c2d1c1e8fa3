//! Properties of the source as text. They need neither the program nor any other package, so they are checked first.
#![cfg(test)]
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod pages_lead_somewhere;
mod python_packages_are_pinned;
mod scripts_are_what_the_pages_say;
mod the_house_stands;
mod third_party_is_listed;

use std::path::{Path, PathBuf};

/// The folder of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A file of the workspace, by its path from there.
fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}
