//! `import FORMAT FILE... -o DATASET`.

use std::path::PathBuf;

use calibench::import::{Holdout, ImportOptions, import};
use calibench::measure::write_dataset;

use super::{Failure, Outcome, print, seed};

#[derive(clap::Args)]
pub struct Arguments {
    /// ur10-ipa, ur5-jacobi, mukca, or generic
    format: String,
    /// Files to read (for mukca also folders)
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Where to write the dataset (a folder); a dataset that is there is replaced
    #[arg(short, long, visible_alias = "out")]
    output: PathBuf,
    /// For generic: the file that says which column is what
    #[arg(long)]
    map: Option<PathBuf>,
    /// Share of the rows to keep for validation, chosen at random
    #[arg(long, value_parser = fraction)]
    holdout: Option<f64>,
    /// Seed of that choice
    #[arg(long, value_parser = seed, allow_negative_numbers = true, default_value_t = 1)]
    seed: u64,
}

fn fraction(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (0.0..1.0).contains(&v) => Ok(v),
        _ => Err("give a share of at least 0 and below 1, e.g. 0.3".into()),
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let holdout = arguments.holdout.map(|fraction| Holdout { fraction, seed: arguments.seed });
    let options = ImportOptions { holdout, map: arguments.map.clone(), ..ImportOptions::default() };
    let (dataset, report) = import(&arguments.format, &arguments.files, &options)?;
    write_dataset(&dataset, &arguments.output)?;
    print(&report.to_string())?;
    print(&format!("{} samples; dataset in {}", dataset.samples.len(), arguments.output.display()))?;
    Ok(Outcome::Done)
}
