//! Properties of the source as text. They need neither the program nor any other package, so they are checked first.
#![cfg(test)]
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod constants_say_why;
mod factors_do_not_fall_back;
mod facts_are_no_text;
mod families_are_named_once;
mod nothing_is_installed;
mod pages_lead_somewhere;
mod python_packages_are_pinned;
mod scripts_are_what_the_pages_say;
mod the_house_stands;
mod third_party_is_listed;
mod values_have_names;

use std::path::{Path, PathBuf};

use syn::Attribute;

/// The folders of the packages; `src` alone of the one at the root, whose folder is everybody's.
const PACKAGES: [&str; 14] = [
    "src",
    "wire",
    "programs",
    "logs",
    "discover",
    "recovery",
    "report",
    "loopback",
    "rehearsal",
    "readout",
    "workbench",
    "sim",
    "cli",
    "web",
];

/// The folder of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A file of the workspace, by its path from there.
fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The Rust sources in a folder of the workspace, or the one file: paths from there, and texts.
fn sources(place: &str) -> Vec<(String, String)> {
    let at = root().join(place);
    if at.is_file() {
        return vec![(place.to_owned(), read(place))];
    }
    let folder = std::fs::read_dir(&at).unwrap_or_else(|e| panic!("{place}: {e}"));
    let mut names: Vec<String> = folder.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let is_source = |name: &String| name.ends_with(".rs") || root().join(place).join(name).is_dir();
    names.into_iter().filter(is_source).flat_map(|name| sources(&format!("{place}/{name}"))).collect()
}

/// The Rust sources of all packages but their tests: paths from the workspace, and texts.
fn production_sources() -> impl Iterator<Item = (String, String)> {
    PACKAGES.into_iter().flat_map(sources).filter(|(path, _)| !path.contains("/tests/"))
}

/// True if an item with these attributes is compiled for tests only.
fn is_test(attributes: &[Attribute]) -> bool {
    let of_test = |a: &Attribute| a.meta.require_list().is_ok_and(|list| list.tokens.to_string().contains("test"));
    attributes.iter().any(|a| a.path().is_ident("cfg") && of_test(a))
}

/// The lines of a source without its comments and its unit tests, which end every file.
fn production(source: &str) -> impl Iterator<Item = &str> {
    let lines = source.lines().take_while(|line| !line.starts_with("#[cfg(test)]"));
    lines.filter(|line| !line.trim_start().starts_with("//"))
}
