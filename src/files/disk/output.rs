//! Checks that an output can be written, made before the work that produces it.

use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use super::folder::refuse_other_content;
use super::target::{folder_of, target_of};
use crate::files::streams::is_standard_output;
use crate::files::{FileError, cannot_be_written};

/// Bytes written as a trial: one block, for which a full disk has no room.
const TRIED: [u8; 4096] = [0; 4096];

/// Checks that [`super::write_whole`] can write a file at `path`, as far as can be told beforehand; leaves nothing behind.
/// Missing parent folders are not an error; they are created on writing.
///
/// # Errors
/// When a folder has that name, a parent is not a folder, or nothing can be created there.
pub fn check_output_file(path: &Path) -> Result<(), FileError> {
    if is_standard_output(path) {
        return Ok(());
    }
    let fail = |e: io::Error| cannot_be_written(path, e);
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => return Err(FileError::whole(path, "is a directory", "name a file")),
        Ok(there) if !there.is_file() => return check_device(path, &there).map_err(fail),
        _ => {}
    }
    check_room_beside(path, &target_of(path).map_err(fail)?)
}

/// Checks that [`crate::files::disk::replace_folder`] can put a folder at `path` with these arguments; leaves nothing behind.
///
/// # Errors
/// When it is a file, has other content, a parent is not a folder, or nothing can be created there.
pub fn check_output_folder(path: &Path, what: &str, mark: &str) -> Result<(), FileError> {
    let target = target_of(path).map_err(|e| cannot_be_written(path, e))?;
    refuse_other_content(path, &target, what, &[mark])?;
    check_room_beside(path, &target)
}

/// An empty write to a character device is harmless and shows whether it accepts more. A pipe or a socket is left to its
/// reader.
#[cfg(unix)]
fn check_device(path: &Path, there: &fs::Metadata) -> io::Result<()> {
    use std::os::unix::fs::FileTypeExt;
    if there.file_type().is_char_device() {
        let taken = OpenOptions::new().write(true).open(path)?.write(&[])?;
        debug_assert_eq!(taken, 0, "of nothing nothing can be taken");
    }
    Ok(())
}

#[cfg(not(unix))]
fn check_device(_: &Path, _: &fs::Metadata) -> io::Result<()> {
    Ok(())
}

/// Checks that something can be created at `target`, or in its nearest existing parent. Errors name `path`.
fn check_room_beside(path: &Path, target: &Path) -> Result<(), FileError> {
    let mut folder = folder_of(target);
    while let Err(e) = fs::metadata(folder) {
        match e.kind() {
            ErrorKind::NotFound if folder != folder_of(folder) => folder = folder_of(folder),
            // A parent is not a folder: the next step up finds it.
            ErrorKind::NotADirectory if folder != folder_of(folder) => folder = folder_of(folder),
            _ => return Err(cannot_be_written(path, e)),
        }
    }
    if !folder.is_dir() {
        let problem = format!("cannot be written: {} is a file", folder.display());
        return Err(FileError::whole(path, problem, "name a folder that is there, or a new one"));
    }
    // Unnamed on most systems, and removed on drop on the others.
    let tried = tempfile::tempfile_in(folder).and_then(|mut file| file.write_all(&TRIED));
    tried.map_err(|e| cannot_be_written(path, e))
}
