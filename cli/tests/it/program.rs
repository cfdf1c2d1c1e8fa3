//! The program as its users start it, and runs of scenarios of the repository.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// The outcome of a command, given in a folder.
pub fn calibench(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calibench")).current_dir(folder).args(arguments).output().unwrap()
}

/// Standard output of a command that succeeds.
#[track_caller]
pub fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = calibench(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The document that a command prints.
#[track_caller]
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&done(folder, arguments)).unwrap()
}

/// The scenarios of the repository.
fn scenarios() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios")
}

/// Path of a scenario of the repository.
pub fn scenario(name: &str) -> String {
    scenarios().join(name).to_str().unwrap().to_owned()
}

/// A new folder in which a scenario of the repository has been run into `run`. The same program runs a scenario once: whoever
/// asks again gets a copy.
pub fn run_of(name: &str) -> TempDir {
    let mut digest = DefaultHasher::new();
    let program = fs::metadata(env!("CARGO_BIN_EXE_calibench")).unwrap();
    (program.modified().unwrap(), program.len(), name).hash(&mut digest);
    let mut files: Vec<PathBuf> = fs::read_dir(scenarios()).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.iter().filter(|file| file.is_file()).for_each(|file| fs::read(file).unwrap().hash(&mut digest));
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("run-{:016x}", digest.finish()));

    // Tests are processes of their own: the first to come makes the run, the others wait.
    let lock = fs::File::create(kept.with_extension("lock")).unwrap();
    lock.lock().unwrap();
    if !kept.is_dir() {
        let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
        done(folder.path(), &["run", &scenario(name), "--out", "run"]);
        fs::rename(folder.path().join("run"), &kept).unwrap();
    }
    drop(lock);

    let folder = tempfile::tempdir().unwrap();
    copy(&kept, &folder.path().join("run"));
    folder
}

/// Copies a folder and everything in it.
fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let at = to.join(path.file_name().unwrap());
        if path.is_dir() { copy(&path, &at) } else { _ = fs::copy(&path, &at).unwrap() }
    }
}
