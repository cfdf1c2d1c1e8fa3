//! Printing and output files of a verb.

use std::io::Write;
use std::path::PathBuf;
use std::sync::OnceLock;

use calibench::files::{FileError, check_output_file};

use super::failure::Failure;
use super::terminal::fitted;

/// Checks that every requested file can be written, before the work that produces it.
pub fn check_outputs<'a>(files: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), FileError> {
    files.into_iter().try_for_each(|file| check_output_file(file))
}

/// Columns that printed text may have; `None` for any number. Set once, before the verb runs.
static COLUMNS: OnceLock<Option<usize>> = OnceLock::new();

/// Fits all that is printed to a terminal of so many columns.
pub fn fit_to(columns: Option<usize>) {
    COLUMNS.get_or_init(|| columns);
}

/// Prints text for people to standard output, as wide as the terminal; a closed pipe is an error, not a panic.
pub fn print(text: &str) -> Result<(), Failure> {
    match COLUMNS.get().copied().flatten() {
        Some(columns) => print_as_it_is(&fitted(text, columns)),
        None => print_as_it_is(text),
    }
}

fn print_as_it_is(text: &str) -> Result<(), Failure> {
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
    print_as_it_is(&serde_json::to_string_pretty(&serde_json::to_value(document)?)?)
}
