//! Exclusive access to a history: checks that are added to it at the same time take turns.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use crate::files::disk::full_path;
use crate::files::{FileError, cannot_be_written};

/// Exclusive access to a history file, to read it and to write it.
///
/// A history is replaced whole, so the lock is on a hidden file beside it, which is removed when the lock is dropped. It is a lock
/// of the operating system, which releases it when a process ends, however it ends.
pub struct HistoryLock {
    beside: PathBuf,
    _locked: File,
}

impl HistoryLock {
    /// Waits until nobody else has access; `waiting` is called once if it must wait.
    ///
    /// # Errors
    /// If the folder of the history cannot be written.
    pub fn acquire(history: &Path, waiting: &mut dyn FnMut()) -> Result<Self, FileError> {
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
                        waiting();
                        told = true;
                    }
                    file.lock().map_err(unwritable)?;
                }
                Err(TryLockError::Error(e)) => return Err(unwritable(e)),
            }
            // Whoever had the lock before has removed the file that was waited for.
            if is_at(&file, &beside) {
                return Ok(HistoryLock { beside, _locked: file });
            }
        }
    }
}

impl Drop for HistoryLock {
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
    fn access_is_exclusive_and_no_file_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let history = folder.path().join("history.toml");
        // What a killed process left behind stops nobody.
        fs::write(folder.path().join(".history.toml.lock"), "").unwrap();
        let count = || fs::read_to_string(&history).ok().and_then(|text| text.parse().ok()).unwrap_or(0_u32);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..25 {
                        let _lock = HistoryLock::acquire(&history, &mut || ()).unwrap();
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
