//! Errors of an import.

use std::path::PathBuf;

use thiserror::Error;

use super::FORMATS;
use crate::files::FileError;

/// Reason why data could not be imported.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ImportError {
    /// No such format.
    #[error("there is no import format '{format}'; there are {}", FORMATS.join(", "))]
    UnknownFormat {
        /// Format as given.
        format: String,
    },
    /// No files were given.
    #[error("no files to import; name at least one")]
    NoFiles,
    /// `generic` without a map.
    #[error("the format 'generic' needs a column map (docs/importing.md shows how)")]
    NoMap,
    /// A robot for a format that knows its own.
    #[error("only the format 'mukca' takes a robot; '{format}' knows its own")]
    RobotIsKnown {
        /// The format.
        format: String,
    },
    /// The fraction is not between 0 and 1.
    #[error("{fraction} is not a share of the rows; give a number between 0 and 1")]
    NotAShare {
        /// Fraction as given.
        fraction: f64,
    },
    /// The numbers of sets and files differ.
    #[error("{sets} sets for {files} files; give one a file")]
    SetsAndFiles {
        /// Number of sets.
        sets: usize,
        /// Number of files.
        files: usize,
    },
    /// Whole files kept for validation, where the files are joined to one table.
    #[error("joined files are one table; keep a share of its rows for validation (`holdout`), not a file")]
    SetsOfJoined,
    /// The files are of two arms.
    #[error("{} and {} are of two robots; import one robot at a time", one.display(), other.display())]
    TwoRobots {
        /// Folder of one robot.
        one: PathBuf,
        /// Folder of the other.
        other: PathBuf,
    },
    /// A base or tool is stated, and the dataset of the set-up has another.
    #[error("{}: has another {what} than is stated for these rows; leave the {what} out, or import without --set-up-of", path.display())]
    StatedOtherwise {
        /// Folder of the dataset whose set-up was requested.
        path: PathBuf,
        /// `base` or `tool`.
        what: &'static str,
    },
    /// The seatings of the sockets do not determine the tool.
    #[error(
        "the flange has the same orientation at all seatings of every socket, so that the tool cannot be determined; import sockets that were seated with the flange turned"
    )]
    ToolUndetermined,
    /// The set-up is that of another robot.
    #[error("{}: is of the robot {other}, the rows are of {robot}; name a dataset of the same robot", path.display())]
    SetUpOfAnother {
        /// Folder of the dataset whose set-up was requested.
        path: PathBuf,
        /// Its robot.
        other: String,
        /// The robot of the rows.
        robot: String,
    },
    /// Base and tool are to be found from poses that do not turn.
    #[error(
        "all poses have one orientation (they turn by {spread_deg:.1} deg): base and tool cannot be told apart; turn the wrist by 30 deg or more about two axes, or state the base or the tool"
    )]
    OneOrientation {
        /// Largest angle between the flange of the first pose and that of another, deg.
        spread_deg: f64,
    },
    /// A file has no usable rows.
    #[error("{}: none of its {rows} rows can be used; the first: {reason}", path.display())]
    NothingKept {
        /// The file.
        path: PathBuf,
        /// Number of its rows.
        rows: usize,
        /// Reason why the first was skipped.
        reason: String,
    },
    /// An error in a file.
    #[error(transparent)]
    File(#[from] FileError),
}
