//! Scenarios as this program reads them: with every plant that it includes.

use std::path::Path;

use calibench::files::FileError;
use calibench_sim::scenario::{Document, Scenario};

/// Reads a scenario file and the files it extends.
///
/// # Errors
/// As [`Document::read`].
pub fn read_document(path: &Path) -> Result<Document, FileError> {
    let document = Document::read(path)?;
    #[cfg(feature = "mujoco")]
    let document = document.with_mujoco(calibench_mujoco::make_plant);
    Ok(document)
}

/// Reads a scenario and the files it extends; every value is checked before anything runs.
///
/// # Errors
/// One error that names file, line, key and remedy.
pub fn read_scenario(path: &Path) -> Result<Scenario, FileError> {
    read_document(path)?.scenario()
}
