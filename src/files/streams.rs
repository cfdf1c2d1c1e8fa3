//! Standard input and standard output in the place of files.
//!
//! They have names that no file has by accident, which a program puts in the place of what its user writes for them, `-` as a
//! rule. Whatever takes the name of a file takes these, and errors name them.
// A browser has neither of them, but their names are distinguished there too.
#![cfg_attr(target_family = "wasm", allow(dead_code))]

use std::fs::File;
use std::io::{self, Read, Seek, Write};
use std::path::Path;
use std::sync::Mutex;

/// The name of standard input.
pub const STANDARD_INPUT: &str = "<standard input>";

/// The name of standard output.
pub const STANDARD_OUTPUT: &str = "<standard output>";

/// True if a path names standard input.
#[must_use]
pub fn is_standard_input(path: &Path) -> bool {
    path == Path::new(STANDARD_INPUT)
}

/// True if a path names standard output.
#[must_use]
pub fn is_standard_output(path: &Path) -> bool {
    path == Path::new(STANDARD_OUTPUT)
}

/// Copy of standard input: a file may be read more than once, a stream may not.
static HELD: Mutex<Option<File>> = Mutex::new(None);

/// Standard input to its end, as a file read from its beginning. The files of several calls share one place of reading: each has
/// to be read before the next is requested.
pub(super) fn standard_input() -> io::Result<File> {
    let mut held = HELD.lock().map_err(|_| io::Error::other("reading it failed before"))?;
    let mut file = match held.as_ref() {
        Some(file) => file.try_clone()?,
        None => {
            let mut file = tempfile::tempfile()?;
            io::copy(&mut io::stdin().lock().by_ref(), &mut file)?;
            file
        }
    };
    *held = Some(file.try_clone()?);
    file.rewind()?;
    Ok(file)
}

/// Writes bytes to standard output.
pub(super) fn write_to_standard_output(content: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(content)?;
    out.flush()
}
