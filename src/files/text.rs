//! Text files, read whole.

use std::io::Read;
use std::path::Path;

use super::disk::{is_folder, open_file};
use super::encoding::in_utf8;
use super::error::{FileError, cannot_be_read};

/// Longest text file read whole, bytes: scenario, robot and calibration files are a thousand times shorter.
const LONGEST_TEXT: u64 = 64 << 20;

/// Reads a text file.
///
/// # Errors
/// When it cannot be read, is a directory, is empty, is longer than 64 MiB, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    let text = String::from_utf8(read_bytes(path)?).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        FileError { line: Some(line), ..FileError::whole(path, "is not UTF-8 text", "save it as UTF-8") }
    })?;
    checked(path, text)
}

/// Reads a text file of somebody else's, in UTF-8 or ISO-8859-1.
///
/// # Errors
/// As [`read_text`], but for the encoding.
pub(crate) fn read_foreign_text(path: &Path) -> Result<String, FileError> {
    checked(path, in_utf8(read_bytes(path)?))
}

/// Reads the bytes of a file.
///
/// # Errors
/// When it cannot be read, is a directory, or is longer than 64 MiB.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, FileError> {
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
    Ok(bytes)
}

/// Text without its byte order mark, unless it is empty or none.
fn checked(path: &Path, text: String) -> Result<String, FileError> {
    if let Some(at) = text.find('\0') {
        let line = 1 + text[..at].matches('\n').count();
        return Err(FileError {
            line: Some(line),
            ..FileError::whole(path, "is not text: it holds NUL bytes", "save it as UTF-8")
        });
    }
    if text.trim().is_empty() {
        return Err(FileError::whole(path, "is empty", "give a file with content"));
    }
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}
