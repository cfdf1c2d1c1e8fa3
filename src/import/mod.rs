//! Other people's data: measurements taken elsewhere, brought into this project's convention.
//!
//! Every format is a column map from the columns of a table to ours; the built-in ones are embedded maps, and `generic` takes
//! one from a file (see `docs/importing.md`).

mod column_map;
mod generic;
mod initial_setup;
mod mukca;
mod report;
mod table;
mod ur10_ipa;
mod ur5_jacobi;

use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use crate::files::FileError;
use crate::measure::{Dataset, SampleSet};

pub use report::{ImportReport, Skipped};

/// Names of the formats.
pub const FORMATS: &[&str] = &["ur10-ipa", "ur5-jacobi", "mukca", "generic"];

/// What the user asks of an import.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ImportOptions {
    /// What the rows of each file may be used for, in the order of the files; empty leaves it to the format.
    pub sets: Vec<SampleSet>,
    /// A share of the rows to keep for validation, at random.
    pub holdout: Option<Holdout>,
    /// The column map of `generic`.
    pub map: Option<PathBuf>,
    /// Of `mukca`: the robot that was measured (a built-in, or a file), where it is not the Panda.
    pub robot: Option<PathBuf>,
}

/// Rows kept for validation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holdout {
    /// Share of the rows that would be fitted, between 0 and 1.
    pub fraction: f64,
    /// Seed of the draw: the same seed keeps the same rows.
    pub seed: u64,
}

/// Why data could not be brought in.
#[derive(Debug, Error)]
pub enum ImportError {
    /// No such format.
    #[error("there is no import format '{format}'; there are {}", FORMATS.join(", "))]
    UnknownFormat {
        /// As given.
        format: String,
    },
    /// No files.
    #[error("no files to import; name at least one")]
    NoFiles,
    /// `generic` without a map.
    #[error("the format 'generic' needs a column map; give one with --map (docs/importing.md shows how)")]
    NoMap,
    /// A robot for a format that knows its own.
    #[error("--robot goes with the format 'mukca'; '{format}' knows its robot")]
    RobotIsKnown {
        /// The format.
        format: String,
    },
    /// A share that is none.
    #[error("{fraction} is not a share of the rows; give a number between 0 and 1")]
    NotAShare {
        /// As given.
        fraction: f64,
    },
    /// Sets and files do not pair up.
    #[error("{sets} sets for {files} files; give one a file")]
    SetsAndFiles {
        /// How many sets.
        sets: usize,
        /// How many files.
        files: usize,
    },
    /// Files of two arms.
    #[error("{} and {} are of two robots; import one robot at a time", one.display(), other.display())]
    TwoRobots {
        /// Folder of one robot.
        one: PathBuf,
        /// Folder of the other.
        other: PathBuf,
    },
    /// Nothing usable in a file.
    #[error("{}: none of its {rows} rows can be used; the first: {reason}", path.display())]
    NothingKept {
        /// The file.
        path: PathBuf,
        /// Its rows.
        rows: usize,
        /// Why the first was skipped.
        reason: String,
    },
    /// A mistake in a file.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Brings files of a [format](FORMATS) into one dataset, and reports what became of every row.
///
/// Rows without a measurement and rows that repeat another to the last digit are skipped and reported; anything else that is wrong is
/// an error. The initial base and tool are fitted in closed form where the format does not give them.
///
/// # Errors
/// See [`ImportError`].
pub fn import(format: &str, files: &[PathBuf], options: &ImportOptions) -> Result<(Dataset, ImportReport), ImportError> {
    if !FORMATS.contains(&format) {
        return Err(ImportError::UnknownFormat { format: format.into() });
    }
    if files.is_empty() {
        return Err(ImportError::NoFiles);
    }
    if options.robot.is_some() && format != "mukca" {
        return Err(ImportError::RobotIsKnown { format: format.into() });
    }
    if let Some(Holdout { fraction, .. }) = options.holdout
        && !(0.0..=1.0).contains(&fraction)
    {
        return Err(ImportError::NotAShare { fraction });
    }
    if !options.sets.is_empty() && options.sets.len() != files.len() {
        return Err(ImportError::SetsAndFiles { sets: options.sets.len(), files: files.len() });
    }
    let (mut dataset, report) = match format {
        "ur10-ipa" => ur10_ipa::import(files, options)?,
        "ur5-jacobi" => ur5_jacobi::import(files, options)?,
        "mukca" => mukca::import(files, options)?,
        _ => generic::import(files, options)?,
    };
    if let Some(holdout) = options.holdout {
        hold_out(&mut dataset, holdout);
    }
    Ok((dataset, report))
}

/// Marks a share of the rows to be fitted as validation.
fn hold_out(dataset: &mut Dataset, Holdout { fraction, seed }: Holdout) {
    let mut places: Vec<usize> = (0..dataset.samples.len()).filter(|&k| dataset.samples[k].set == SampleSet::Fit).collect();
    let count = (fraction * places.len() as f64).round() as usize;
    places.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    for &k in &places[..count] {
        dataset.samples[k].set = SampleSet::Validation;
    }
}

/// A name for each file: that of its folder where that tells them apart, else its own, else both.
fn labels(files: &[PathBuf]) -> Vec<String> {
    let folder = |p: &Path| p.parent().and_then(Path::file_name).map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = |p: &Path| p.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let distinct = |names: &[String]| (0..names.len()).all(|k| !names[k].is_empty() && !names[..k].contains(&names[k]));
    let by_folder: Vec<String> = files.iter().map(|p| folder(p)).collect();
    let by_name: Vec<String> = files.iter().map(|p| stem(p)).collect();
    if files.len() > 1 && distinct(&by_folder) {
        by_folder
    } else if distinct(&by_name) {
        by_name
    } else {
        files.iter().enumerate().map(|(k, p)| format!("{}-{}-{}", k + 1, folder(p), stem(p))).collect()
    }
}
