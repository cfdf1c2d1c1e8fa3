//! Errors of making a recording.

use std::path::PathBuf;

use calibench::files::{FileError, one_line};
use calibench::identify::calibration::IdentifyError;
use thiserror::Error;

/// Reasons why no recording was made; a message is one line.
#[derive(Debug, Error)]
pub enum ViewError {
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The folder is neither a run nor a dataset.
    #[error("{}: is neither a run nor a dataset; name the folder that `calibench run --out` wrote, or one with dataset.toml and samples.csv", one_line(&.0.display().to_string()))]
    NothingToReplay(PathBuf),
    /// Data and calibration do not match, or do not determine the robot.
    #[error("{}: {}", one_line(&folder.display().to_string()), one_line(&source.to_string()))]
    Identify {
        /// The folder.
        folder: PathBuf,
        /// The reason.
        source: Box<IdentifyError>,
    },
    /// The recorder failed.
    #[error("the recording cannot be made: {}", one_line(&.0.to_string()))]
    Recorder(#[from] rerun::RecordingStreamError),
    /// The recorder cannot write.
    #[error("the recording cannot be written: {}", one_line(&.0.to_string()))]
    Writing(#[from] rerun::sink::SinkFlushError),
}
