//! Errors of a log.

use std::path::PathBuf;

use calibench::files::{FileError, one_line};
use calibench::import::ImportError;

/// Reason why a log gives no measurements.
#[derive(Debug)]
pub enum LogError {
    /// A file cannot be read, or holds no such content.
    File(Box<FileError>),
    /// The columns of its table are not understood.
    Import(Box<ImportError>),
    /// Joints and measurements are there, and do not make a table.
    Content {
        /// The files.
        files: Vec<PathBuf>,
        /// The problem.
        problem: String,
        /// The remedy.
        remedy: String,
    },
}

impl std::fmt::Display for LogError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            LogError::File(error) => error.fmt(f),
            LogError::Import(error) => error.fmt(f),
            LogError::Content { files, problem, remedy } => {
                let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
                f.write_str(&one_line(&format!("{}: {problem}; {remedy}", files.join(", "))))
            }
        }
    }
}

impl std::error::Error for LogError {}

impl From<FileError> for LogError {
    fn from(error: FileError) -> Self {
        LogError::File(Box::new(error))
    }
}

impl From<ImportError> for LogError {
    fn from(error: ImportError) -> Self {
        LogError::Import(Box::new(error))
    }
}
