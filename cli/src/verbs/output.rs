//! Printing and output files of a verb.

use std::io::Write;
use std::path::PathBuf;

use calibench::files::{FileError, check_output_file};

use super::failure::Failure;

/// Checks that every requested file can be written, before the work that produces it.
pub fn check_outputs<'a>(files: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), FileError> {
    files.into_iter().try_for_each(|file| check_output_file(file))
}

/// Prints text to standard output; a closed pipe is an error, not a panic.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.write_all(b"\n")?;
    Ok(())
}

/// Writes bytes to standard output as they are.
pub fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    std::io::stdout().lock().write_all(bytes)?;
    Ok(())
}

/// Prints one JSON document, keys in alphabetical order.
pub fn print_json(document: &impl serde::Serialize) -> Result<(), Failure> {
    print(&serde_json::to_string_pretty(&serde_json::to_value(document)?)?)
}
