//! Files in memory, for a program in a browser: names are paths relative to nothing, folders are there while something is in
//! them. Whoever runs the program puts its inputs here, and takes what it wrote.

use std::collections::BTreeMap;
use std::io::{Cursor, Error, ErrorKind, Result, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::error::FileError;

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

/// An open file.
pub type OpenFile = Cursor<Arc<[u8]>>;

/// Opens a file for reading. The error is worded as that of the disk, so that a message is the same wherever the program runs.
///
/// # Errors
/// When there is no such file.
pub fn open_file(path: &Path) -> Result<OpenFile> {
    match content(path) {
        Some(content) => Ok(Cursor::new(content)),
        None if is_folder(path) => Err(Error::new(ErrorKind::IsADirectory, "Is a directory (os error 21)")),
        None => Err(Error::new(ErrorKind::NotFound, "No such file or directory (os error 2)")),
    }
}

/// Reads a file whole.
///
/// # Errors
/// When there is no such file.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    open_file(path).map(|file| file.into_inner().to_vec())
}

/// True if there is a file with this name.
#[must_use]
pub fn is_file(path: &Path) -> bool {
    content(path).is_some()
}

/// True if there are files in this folder.
#[must_use]
pub fn is_folder(path: &Path) -> bool {
    let path = plain(path);
    files().keys().any(|name| *name != path && name.starts_with(&path))
}

/// True if there is anything with this name.
#[must_use]
pub fn is_there(path: &Path) -> bool {
    is_file(path) || is_folder(path)
}

/// Keeps a file.
///
/// # Errors
/// None.
pub fn write_whole(path: &Path, content: &[u8]) -> std::result::Result<(), FileError> {
    put_file(path, content.to_vec());
    Ok(())
}

/// Keeps what `write` writes.
///
/// # Errors
/// Those of `write`.
pub fn write_streamed<T>(
    path: &Path,
    write: impl FnOnce(&mut (dyn Write + Send)) -> std::result::Result<T, FileError>,
) -> std::result::Result<T, FileError> {
    let mut all = Vec::new();
    let written = write(&mut all)?;
    put_file(path, all);
    Ok(written)
}

/// Fills a folder, keeping its other entries besides `names`.
///
/// # Errors
/// Those of `fill`, with the final names of the files.
pub fn replace_folder(
    folder: &Path,
    _what: &str,
    names: &[&str],
    fill: impl FnOnce(&Path) -> std::result::Result<(), FileError>,
) -> std::result::Result<(), FileError> {
    let new = plain(&folder.with_file_name(".new"));
    let filled = fill(&new).map_err(|e| match e.path.strip_prefix(&new) {
        Ok(inside) => FileError { path: folder.join(inside), ..e },
        Err(_) => e,
    });
    let mut made: Vec<(PathBuf, Arc<[u8]>)> = Vec::new();
    files().retain(|name, content| match name.strip_prefix(&new) {
        Ok(inside) => {
            made.push((plain(folder).join(inside), content.clone()));
            false
        }
        Err(_) => true,
    });
    filled?;
    names.iter().for_each(|name| remove(&folder.join(name)));
    files().extend(made);
    Ok(())
}

/// Memory takes any file.
///
/// # Errors
/// None.
pub fn check_output_file(_: &Path) -> std::result::Result<(), FileError> {
    Ok(())
}

/// Memory takes any folder.
///
/// # Errors
/// None.
pub fn check_output_folder(_: &Path, _what: &str, _mark: &str) -> std::result::Result<(), FileError> {
    Ok(())
}

/// Does nothing: memory needs no synchronising.
pub(crate) fn sync_folder_of(_: &Path) -> Result<()> {
    Ok(())
}
