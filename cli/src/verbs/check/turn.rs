//! Checks that are added to one history at the same time take turns.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use calibench::files::disk::full_path;
use calibench::files::{FileError, cannot_be_written};

use super::super::output::note;

/// Exclusive access to a history file, for reading and writing.
///
/// The history is replaced whole, so it cannot bear the lock itself: a hidden file beside it does, and is removed after the
/// turn. The lock is the system's, which releases it when a process ends, however it ends.
pub struct Turn {
    beside: PathBuf,
    _locked: File,
}

impl Turn {
    /// Waits until nobody has the turn.
    ///
    /// # Errors
    /// If the folder of the history cannot be written.
    pub fn at(history: &Path) -> Result<Self, FileError> {
        let unwritable = |e: io::Error| cannot_be_written(history, e);
        let path = full_path(history);
        let mut name = OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(".lock");
        let beside = path.with_file_name(name);
        if let Some(folder) = beside.parent() {
            fs::create_dir_all(folder).map_err(unwritable)?;
        }
        let mut told = false;
        loop {
            let file =
                OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&beside).map_err(unwritable)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    if !told {
                        note(&format!("{}: another check is being added; this one waits.", history.display()));
                        told = true;
                    }
                    file.lock().map_err(unwritable)?;
                }
                Err(TryLockError::Error(e)) => return Err(unwritable(e)),
            }
            // Whoever had the turn before has removed the file that was waited for.
            if is_at(&file, &beside) {
                return Ok(Turn { beside, _locked: file });
            }
        }
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        if REMOVED {
            drop(fs::remove_file(&self.beside));
        }
    }
}

/// True where the lock file is removed: only on systems that can tell whether a path still leads to an open file.
const REMOVED: bool = cfg!(unix);

/// True if the path leads to this file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let there = (file.metadata(), fs::metadata(path));
    matches!(there, (Ok(open), Ok(named)) if (open.dev(), open.ino()) == (named.dev(), named.ino()))
}

#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_has_the_turn_of_another_and_no_file_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let history = folder.path().join("history.toml");
        // What a killed process left behind stops nobody.
        fs::write(folder.path().join(".history.toml.lock"), "").unwrap();
        let count = || fs::read_to_string(&history).ok().and_then(|text| text.parse().ok()).unwrap_or(0_u32);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..25 {
                        let _turn = Turn::at(&history).unwrap();
                        fs::write(&history, (count() + 1).to_string()).unwrap();
                    }
                });
            }
        });
        assert_eq!(count(), 200);
        let left = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, if REMOVED { 1 } else { 2 });
    }
}
