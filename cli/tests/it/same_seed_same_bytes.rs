//! The same scenario and seed always give the same bytes, on any number of threads; another seed gives others.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/table8.toml");

/// Collects every file below a folder, by its relative path.
fn files(folder: &Path, below: &Path, all: &mut BTreeMap<PathBuf, Vec<u8>>) {
    for entry in fs::read_dir(folder.join(below)).expect("a folder") {
        let path = below.join(entry.expect("an entry").file_name());
        if folder.join(&path).is_dir() {
            files(folder, &path, all);
        } else {
            all.insert(path.clone(), fs::read(folder.join(&path)).expect("a file"));
        }
    }
}

/// Printed output (under the empty path) and written files of a run.
fn run(seed: &str, threads: Option<&str>) -> BTreeMap<PathBuf, Vec<u8>> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    // The output's name appears in the printed text, so all use the same relative one.
    command.current_dir(&folder).args(["run", SCENARIO, "--seed", seed, "--out", "run"]);
    command.env_remove("RAYON_NUM_THREADS").envs(threads.map(|n| ("RAYON_NUM_THREADS", n)));
    let output = command.output().expect("the program runs");
    // 1 means that an expectation was missed, which may happen with another seed.
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&output.stderr));
    let mut all = BTreeMap::from([(PathBuf::new(), output.stdout)]);
    files(&folder.path().join("run"), Path::new(""), &mut all);
    all
}

#[test]
fn threads_and_repetition_change_no_byte_and_the_seed_does() {
    let first = run("3", Some("2"));
    assert!(first.len() > 10 && first.values().all(|bytes| !bytes.is_empty()), "{:?}", first.keys());
    for threads in [Some("1"), Some("5")] {
        let again = run("3", threads);
        assert!(again.keys().eq(first.keys()), "{threads:?} threads: {:?}", again.keys());
        for (path, bytes) in &first {
            assert!(again[path] == *bytes, "{} differs with {threads:?} threads", path.display());
        }
    }
    let other = run("4", None);
    for (path, bytes) in &first {
        // Dataset description, model and scene describe the same cell.
        let of_the_cell = ["dataset.toml", "model.toml", "scene.toml"];
        if path.file_name().is_none_or(|name| !of_the_cell.iter().any(|file| name == *file)) {
            assert!(other[path] != *bytes, "{} is the same with another seed", path.display());
        }
    }
}
