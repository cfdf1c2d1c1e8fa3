//! An error in a file: it names the file, the line, the field and the remedy.

use std::borrow::Cow;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// An error in a file, its location and the remedy.
#[derive(Debug, Error)]
#[error("{}", one_line(&self.words()))]
pub struct FileError {
    /// The file.
    pub path: PathBuf,
    /// Line of the error, counted from 1, if it has one.
    pub line: Option<usize>,
    /// Key or column.
    pub field: String,
    /// The problem.
    pub problem: String,
    /// The remedy.
    pub remedy: String,
    /// Kind of the error.
    pub kind: FileErrorKind,
    /// The error of the system or of a parser behind it, whose words are part of the problem's.
    pub source: Option<Box<dyn std::error::Error + Send + Sync>>,
}

/// Kinds of errors in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileErrorKind {
    /// The content is not as it must be: a line, a field, a value.
    Content,
    /// There is no such file, or it may not be read.
    Unreadable,
    /// The path cannot be written: a missing permission, a folder in its place.
    Unwritable,
    /// The disk that is to be written is full or fails.
    Disk,
    /// An unfinished campaign is in the way.
    UnfinishedCampaign,
}

impl FileError {
    fn words(&self) -> String {
        let FileError { path, line, field, problem, remedy, .. } = self;
        // A message that quotes all of a garbled file is of no help.
        let [field, problem] = [shortened(field), shortened(problem)];
        let line = line.map(|l| format!(":{l}")).unwrap_or_default();
        let field = if field.is_empty() { String::new() } else { format!(": {field}") };
        format!("{}{line}{field}: {problem}; {remedy}", path.display())
    }

    /// Creates an error of the whole file.
    pub fn whole(path: &Path, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (problem, remedy) = (problem.into(), remedy.into());
        FileError {
            path: path.into(),
            line: None,
            field: String::new(),
            problem,
            remedy,
            kind: FileErrorKind::Content,
            source: None,
        }
    }
}

/// Longest part of a message, characters.
const LONGEST_PART: usize = 600;

fn shortened(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(LONGEST_PART) {
        Some((end, _)) => Cow::Owned(format!("{} ...", &text[..end])),
        None => Cow::Borrowed(text),
    }
}

/// Puts the text on one line: text from a file or a flag may contain line breaks or terminal control characters, and is quoted
/// in errors.
///
/// ```
/// assert_eq!(calibench::files::one_line("robot\nkr6"), "robot\\nkr6");
/// ```
pub fn one_line(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
}

/// The error of a file that cannot be read.
pub fn cannot_be_read(path: &Path, error: impl std::error::Error + Send + Sync + 'static) -> FileError {
    let problem = format!("cannot be read: {error}");
    FileError {
        kind: FileErrorKind::Unreadable,
        source: Some(Box::new(error)),
        ..FileError::whole(path, problem, "check the path and its permissions")
    }
}

/// The error of a file that cannot be written; a disk that is full or fails has a kind of its own.
pub fn cannot_be_written(path: &Path, error: impl std::error::Error + Send + Sync + 'static) -> FileError {
    let kind = if is_of_disk(&error) { FileErrorKind::Disk } else { FileErrorKind::Unwritable };
    let problem = format!("cannot be written: {error}");
    FileError {
        kind,
        source: Some(Box::new(error)),
        ..FileError::whole(path, problem, "check the folder, its permissions and free space")
    }
}

/// An error and the chain of its sources in one sentence; a source whose words the message holds already is not repeated.
pub fn with_reasons(error: &dyn std::error::Error) -> String {
    let mut message = error.to_string();
    let mut reason = error.source();
    while let Some(inner) = reason {
        let words = inner.to_string();
        if !message.contains(&words) {
            message.push_str(&format!(": {words}"));
        }
        reason = inner.source();
    }
    message
}

/// True if the system reports that a disk is full or fails.
fn is_of_disk(error: &(dyn std::error::Error + 'static)) -> bool {
    let reasons = std::iter::successors(Some(error), |error| error.source());
    let mut of_system = reasons.filter_map(|reason| reason.downcast_ref::<std::io::Error>());
    of_system.any(|error| {
        let full = matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge);
        full || error.raw_os_error() == Some(INPUT_OUTPUT_ERROR)
    })
}

/// EIO on every Unix, which has no error kind of its own; on Windows 5 means access denied, which must not be taken for it.
const INPUT_OUTPUT_ERROR: i32 = if cfg!(unix) { 5 } else { i32::MIN };
