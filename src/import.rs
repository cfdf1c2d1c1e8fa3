//! Import of measurements taken elsewhere into this project's convention.
//!
//! Every format is a column map from the columns of a table to those of a dataset; the built-in ones are embedded maps, and
//! `generic` reads one from a file (see `docs/importing.md`).

mod balance;
mod column_map;
mod error;
mod generic;
mod guess;
mod initial_setup;
mod mukca;
mod options;
mod report;
mod rotation;
mod row_order;
mod source;
mod table;
mod unknown_table;
mod ur10_ipa;
mod ur5_jacobi;

use std::path::PathBuf;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use self::balance::balance;
use self::initial_setup::take_set_up;
use crate::measure::dataset::{Dataset, SampleSet};

pub use error::ImportError;
pub use guess::{Guess, guess};
pub use options::{FORMATS, Holdout, ImportOptions};
pub use report::{ImportReport, Skipped};

/// Imports files of a [format](FORMATS) into one dataset, and reports the outcome of every row.
///
/// Rows without a measurement and rows that repeat another to the last digit are skipped and reported; any other problem is an
/// error. The initial base and tool are fitted in closed form if neither the format nor a dataset of the same set-up gives them.
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
    let (mut dataset, mut report) = match format {
        "ur10-ipa" => ur10_ipa::import(files, options)?,
        "ur5-jacobi" => ur5_jacobi::import(files, options)?,
        "mukca" => mukca::import(files, options)?,
        _ => generic::import(files, options)?,
    };
    if let Some(folder) = &options.set_up_of {
        take_set_up(&mut dataset, folder)?;
    }
    if let Some(holdout) = options.holdout {
        hold_out(&mut dataset, holdout);
    }
    balance(&mut dataset, &mut report);
    Ok((dataset, report))
}

/// Marks a fraction of the fit rows as validation.
fn hold_out(dataset: &mut Dataset, Holdout { fraction, seed }: Holdout) {
    let mut places: Vec<usize> = (0..dataset.samples.len()).filter(|&k| dataset.samples[k].set == SampleSet::Fit).collect();
    let count = (fraction * places.len() as f64).round() as usize;
    places.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    for &k in &places[..count] {
        dataset.samples[k].set = SampleSet::Validation;
    }
}
