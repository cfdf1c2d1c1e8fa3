//! Files on the disk.

use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::Path;

use crate::files::streams::{is_standard_input, standard_input};

/// An open file.
pub type OpenFile = File;

/// Opens a file for reading, or [standard input](crate::files::streams::STANDARD_INPUT). Pipes and devices are not opened: a pipe would block until it is written to, and a device need not
/// end.
///
/// # Errors
/// When there is no such file, it may not be read, or it is a pipe or a device.
pub fn open_file(path: &Path) -> io::Result<OpenFile> {
    if is_standard_input(path) {
        return standard_input();
    }
    let kind = std::fs::metadata(path)?;
    if !kind.is_file() && !kind.is_dir() {
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is a pipe or a device, and not a file"));
    }
    File::open(path)
}

/// Reads a file whole, whatever is in it.
///
/// # Errors
/// When it cannot be read.
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    std::fs::read(path)
}

/// True if there is a file with this name.
#[must_use]
pub fn is_file(path: &Path) -> bool {
    path.is_file()
}

/// True if there is a folder with this name.
#[must_use]
pub fn is_folder(path: &Path) -> bool {
    path.is_dir()
}

/// True if there is anything with this name.
#[must_use]
pub fn is_there(path: &Path) -> bool {
    path.exists()
}
