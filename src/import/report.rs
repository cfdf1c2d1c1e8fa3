//! Report on every row of an import.

use std::fmt;
use std::path::PathBuf;

/// A skipped row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skipped {
    /// Path of the file.
    pub path: PathBuf,
    /// Line, counted from 1.
    pub line: usize,
    /// Reason.
    pub reason: String,
}

/// Outcome of the rows of an import.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ImportReport {
    /// Rows in the files, headers not counted.
    pub rows_read: usize,
    /// Rows imported as samples.
    pub rows_kept: usize,
    /// The skipped rows.
    pub skipped: Vec<Skipped>,
    /// Other remarks, such as a column that could not be used.
    pub notes: Vec<String>,
}

/// Maximum number of skipped rows printed individually.
const PRINTED: usize = 10;

impl fmt::Display for ImportReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} rows read, {} kept, {} skipped", self.rows_read, self.rows_kept, self.skipped.len())?;
        for s in self.skipped.iter().take(PRINTED) {
            write!(f, "\n  {}:{}: {}", s.path.display(), s.line, s.reason)?;
        }
        if self.skipped.len() > PRINTED {
            write!(f, "\n  and {} more", self.skipped.len() - PRINTED)?;
        }
        for note in &self.notes {
            write!(f, "\n  {note}")?;
        }
        Ok(())
    }
}
