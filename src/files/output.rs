//! Whether an output can be written, asked before the work that makes it.

use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::folder::refuse_other_content;
use super::{FileError, cannot_be_written};

/// Links followed before they are taken for a circle: the limit of Linux.
const MOST_LINKS: usize = 40;

/// Bytes tried on the disk: one block, which a full disk has not.
const TRIED: [u8; 4096] = [0; 4096];

/// That a file can be written at `path` by [`super::write_whole`], as far as can be told beforehand: nothing stays behind. Missing folders
/// above it are no fault; they are made when it is written.
///
/// # Errors
/// When a folder has that name, something above it is no folder, or nothing can be made there.
pub fn check_output_file(path: &Path) -> Result<(), FileError> {
    let fail = |e: io::Error| cannot_be_written(path, &e);
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => return Err(FileError::whole(path, "is a directory", "name a file")),
        Ok(there) if !there.is_file() => return check_device(path, &there).map_err(fail),
        _ => {}
    }
    check_room_beside(path, &target_of(path).map_err(fail)?)
}

/// That a folder can be put at `path` by [`super::replace_folder`] with these arguments; nothing stays behind.
///
/// # Errors
/// When it is a file, holds something else, something above it is no folder, or nothing can be made there.
pub fn check_output_folder(path: &Path, what: &str, mark: &str) -> Result<(), FileError> {
    let target = target_of(path).map_err(|e| cannot_be_written(path, &e))?;
    refuse_other_content(path, &target, what, &[mark])?;
    check_room_beside(path, &target)
}

/// Where writing at `path` leads: through symbolic links, also to what is not there yet.
pub(super) fn target_of(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&target) {
            Ok(next) => target = folder_of(&target).join(next),
            // No link, or nothing there.
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::new(ErrorKind::InvalidInput, "its symbolic links lead in a circle"))
}

/// The folder in which `path` is an entry.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A character device takes nothing without harm, and says whether it would take more. A pipe or a socket is left to whoever reads it.
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

/// That something can be made where `target` is to be, or in the nearest folder above it that there is. Errors are of `path`.
fn check_room_beside(path: &Path, target: &Path) -> Result<(), FileError> {
    let mut folder = folder_of(target);
    while let Err(e) = fs::metadata(folder) {
        match e.kind() {
            ErrorKind::NotFound if folder != folder_of(folder) => folder = folder_of(folder),
            // Something above it is no folder: the next step up says which.
            ErrorKind::NotADirectory if folder != folder_of(folder) => folder = folder_of(folder),
            _ => return Err(cannot_be_written(path, &e)),
        }
    }
    if !folder.is_dir() {
        let problem = format!("cannot be written: {} is a file", folder.display());
        return Err(FileError::whole(path, problem, "name a folder that is there, or a new one"));
    }
    // Without a name on most systems, and removed by its drop on the others.
    let tried = tempfile::tempfile_in(folder).and_then(|mut file| file.write_all(&TRIED));
    tried.map_err(|e| cannot_be_written(path, &e))
}
