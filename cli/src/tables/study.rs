//! The results of a study as files.

use std::path::{Path, PathBuf};

use calibench::files::disk::write_whole;
use serde_json::Value;

use crate::terminal::failure::Failure;
use crate::terminal::streams::output;
use calibench_lab::study::{expect_parquet, study_page, write_parquet};

/// Optional products of a table of trials.
#[derive(clap::Args)]
pub struct Products {
    /// Output file for the table of trials in Parquet format, by a program built with the feature `parquet`
    #[arg(long, value_name = "FILE", value_parser = output())]
    pub parquet: Option<PathBuf>,
    /// Output file for a self-contained page (HTML): response curves with their bands, and the numbers
    #[arg(long, value_name = "FILE", value_parser = output())]
    pub report: Option<PathBuf>,
}

impl Products {
    /// The requested files.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.parquet.iter().chain(&self.report)
    }

    /// Refuses, before the work, what this build of the program cannot write.
    pub fn expect(&self) -> Result<(), Failure> {
        self.parquet.iter().try_for_each(|path| expect_parquet(path)).map_err(Failure::from)
    }

    /// Writes the requested files.
    pub fn make(&self, tables: &[&Path], document: &Value) -> Result<(), Failure> {
        if let Some(path) = &self.parquet {
            write_parquet(tables, path)?;
        }
        if let Some(path) = &self.report {
            write_whole(path, study_page(document).as_bytes())?;
        }
        Ok(())
    }
}
