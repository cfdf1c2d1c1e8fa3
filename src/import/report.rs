//! What became of every row of an import.

use std::fmt;
use std::path::PathBuf;

/// A row that was not taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skipped {
    /// File.
    pub path: PathBuf,
    /// Line, counted from 1.
    pub line: usize,
    /// Why.
    pub reason: String,
}

/// What became of the rows of an import.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ImportReport {
    /// Rows in the files, headers not counted.
    pub rows_read: usize,
    /// Rows that are now samples.
    pub rows_kept: usize,
    /// The others.
    pub skipped: Vec<Skipped>,
    /// What else there is to know, such as a column that could not be used.
    pub notes: Vec<String>,
}

/// How many skipped rows are printed one by one.
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
