//! Text files, read whole.

use std::io::Read;
use std::path::Path;

use super::error::{FileError, cannot_be_read};
use super::place::{OpenFile, is_folder};
#[cfg(not(target_family = "wasm"))]
use super::streams::{is_standard_input, standard_input};

/// Longest text file read whole, bytes: scenario, robot and calibration files are a thousand times shorter.
const LONGEST_TEXT: u64 = 64 << 20;

/// Opens a file for reading, or [standard input](super::STANDARD_INPUT). Pipes and devices are not opened: a pipe would block until it is written to, and a device need not
/// end.
///
/// # Errors
/// When there is no such file, it may not be read, or it is a pipe or a device.
#[cfg(not(target_family = "wasm"))]
pub fn open_file(path: &Path) -> std::io::Result<OpenFile> {
    if is_standard_input(path) {
        return standard_input();
    }
    let kind = std::fs::metadata(path)?;
    if !kind.is_file() && !kind.is_dir() {
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, "it is a pipe or a device, and not a file"));
    }
    OpenFile::open(path)
}

/// Opens a file in memory for reading.
///
/// # Errors
/// When there is no such file.
#[cfg(target_family = "wasm")]
pub fn open_file(path: &Path) -> std::io::Result<OpenFile> {
    super::memory::open(path)
}

/// Reads a text file.
///
/// # Errors
/// When it cannot be read, is a directory, is empty, is longer than 64 MiB, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    if is_folder(path) {
        return Err(FileError::whole(path, "is a directory", "name a file"));
    }
    let mut bytes = Vec::new();
    open_file(path)
        .and_then(|file| file.take(LONGEST_TEXT + 1).read_to_end(&mut bytes))
        .map_err(|e| cannot_be_read(path, e))?;
    if bytes.len() as u64 > LONGEST_TEXT {
        return Err(FileError::whole(path, "is longer than 64 MiB", "check that it is the file you meant"));
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        FileError { line: Some(line), ..FileError::whole(path, "is not UTF-8 text", "save it as UTF-8") }
    })?;
    if let Some(at) = text.find('\0') {
        let line = 1 + text[..at].matches('\n').count();
        return Err(FileError {
            line: Some(line),
            ..FileError::whole(path, "is no text: it holds NUL bytes", "save it as UTF-8")
        });
    }
    if text.trim().is_empty() {
        return Err(FileError::whole(path, "is empty", "give a file with content"));
    }
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}
