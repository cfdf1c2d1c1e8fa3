//! Outcomes and errors of a verb.

use std::path::PathBuf;

use calibench::compensate::TaskError;
use calibench::effects::EffectError;
use calibench::files::with_reasons;
use calibench::files::{FileError, FileErrorKind};
use calibench::import::ImportError;
use calibench::measure::session::StartError;

/// Any error that ends a verb; printed with its chain of causes.
pub type Failure = Box<dyn std::error::Error>;

/// Outcome of a verb that ran to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    Done,
    ExpectationFailed,
}

/// Exit code: the input cannot be used.
pub const BAD_INPUT: u8 = 2;

/// Exit code: the cell or the disk failed during the work.
pub const HARDWARE: u8 = 3;

/// A device of the cell malfunctions.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Hardware(pub String);

/// `probings are`, of one `probing is`.
fn are(count: usize, what: &str) -> String {
    if count == 1 { format!("{} is", what.trim_end_matches('s')) } else { format!("{what} are") }
}

/// What a campaign measures.
pub const PROBINGS: &str = "probings";

/// A campaign interrupted by its cell or by the disk; its measurements are in its journal.
#[derive(Debug, thiserror::Error)]
#[error("{why}; {kept} {} kept in {}: go on with `--resume`", are(*kept, what), journal.display())]
pub struct Interrupted {
    pub why: String,
    /// What was measured, in the plural.
    pub what: &'static str,
    pub kept: usize,
    pub journal: PathBuf,
}

pub use calibench_workbench::LocatedError;

/// True if a full or failing disk is among the causes.
pub fn is_of_disk(failure: &(dyn std::error::Error + 'static)) -> bool {
    let mut reasons = std::iter::successors(Some(failure), |reason| reason.source());
    reasons.any(|reason| reason.downcast_ref::<FileError>().is_some_and(|e| e.kind == FileErrorKind::Disk))
}

/// True if the reader of the output closed the pipe.
pub fn is_closed_pipe(failure: &(dyn std::error::Error + 'static)) -> bool {
    let mut reasons = std::iter::successors(Some(failure), |reason| reason.source());
    let of_system = |reason: &(dyn std::error::Error + 'static)| Some(reason.downcast_ref::<std::io::Error>()?.kind());
    reasons.any(|reason| of_system(reason) == Some(std::io::ErrorKind::BrokenPipe))
}

pub fn hardware(error: &(dyn std::error::Error + 'static)) -> Hardware {
    Hardware(with_reasons(error))
}

/// A session that did not start: bad input, or a device of the cell.
pub fn not_started(error: StartError) -> Failure {
    if error.is_of_the_request() { error.into() } else { hardware(&error).into() }
}

/// The option or verb that applies the remedy of a library error, if there is one.
pub fn hint(failure: &(dyn std::error::Error + 'static)) -> Option<&'static str> {
    std::iter::successors(Some(failure), |reason| reason.source()).find_map(|reason| {
        if let Some(error) = reason.downcast_ref() {
            return match error {
                TaskError::NoSetup => Some("`calibench identify` writes one that names its set-ups"),
                TaskError::SeveralSetups { .. } => Some("--session NAME chooses it"),
                _ => None,
            };
        }
        if let Some(error) = reason.downcast_ref() {
            return match error {
                ImportError::NoMap => Some("--map FILE names it"),
                ImportError::RobotIsKnown { .. } => Some("leave --robot out"),
                _ => None,
            };
        }
        if let Some(EffectError::Unknown { .. }) = reason.downcast_ref() {
            return Some("`calibench effects` lists what there is");
        }
        let file: &FileError = reason.downcast_ref()?;
        match file.kind {
            FileErrorKind::UnfinishedCampaign => Some("--resume goes on with it"),
            FileErrorKind::Content if file.field == "payload" => Some("--load describes one"),
            _ => None,
        }
    })
}
