//! Files in memory, for a program in a browser: names are paths relative to nothing, folders are there while something is in
//! them. Whoever runs the program puts its inputs here, and takes what it wrote.

use std::collections::BTreeMap;
use std::io::{Cursor, Error, ErrorKind, Result};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::place::OpenFile;

static FILES: Mutex<BTreeMap<PathBuf, Arc<[u8]>>> = Mutex::new(BTreeMap::new());

fn files() -> MutexGuard<'static, BTreeMap<PathBuf, Arc<[u8]>>> {
    FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The same path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => _ = plain.pop(),
            other => plain.push(other),
        }
    }
    plain
}

/// Puts a file in the place of any of the same name.
pub fn put_file(path: &Path, content: Vec<u8>) {
    files().insert(plain(path), content.into());
}

/// The content of a file.
#[must_use]
pub fn content(path: &Path) -> Option<Arc<[u8]>> {
    files().get(&plain(path)).cloned()
}

/// Removes a file, or all files of a folder.
pub fn remove(path: &Path) {
    let path = plain(path);
    files().retain(|name, _| !name.starts_with(&path));
}

pub(super) fn is_folder(path: &Path) -> bool {
    let path = plain(path);
    files().keys().any(|name| *name != path && name.starts_with(&path))
}

/// The error is worded as that of the disk, so that a message is the same wherever the program runs.
pub(super) fn open(path: &Path) -> Result<OpenFile> {
    match content(path) {
        Some(content) => Ok(Cursor::new(content)),
        None if is_folder(path) => Err(Error::new(ErrorKind::IsADirectory, "Is a directory (os error 21)")),
        None => Err(Error::new(ErrorKind::NotFound, "No such file or directory (os error 2)")),
    }
}

/// Puts the files of the folder `new` into `folder`, in the place of those of these names.
pub(super) fn replace(folder: &Path, new: &Path, names: &[&str]) {
    names.iter().for_each(|name| remove(&folder.join(name)));
    let (folder, new) = (plain(folder), plain(new));
    let mut files = files();
    let moved: Vec<(PathBuf, Arc<[u8]>)> = files
        .iter()
        .filter_map(|(name, content)| Some((folder.join(name.strip_prefix(&new).ok()?), content.clone())))
        .collect();
    files.retain(|name, _| !name.starts_with(&new));
    files.extend(moved);
}
