//! `sim merge SHARD...`: combines the shards of a study.

use std::path::{Path, PathBuf};

use crate::tables::study::Products;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print_answer, print_json};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::output;
use calibench_lab::study::{merge, study_json, study_text};

#[derive(clap::Args)]
pub struct Arguments {
    /// Tables of one study written by `sim study`, in any order; a single one is summarised
    #[arg(required = true)]
    shards: Vec<PathBuf>,
    /// Output file for the combined table (CSV), byte-identical to that of a single run
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    #[command(flatten)]
    products: Products,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    arguments.products.expect()?;
    check_outputs(arguments.output.iter().chain(arguments.products.files()))?;
    let waiting = Waiting::new("reading");
    let merged = merge(&arguments.shards, arguments.output.as_deref())?;
    if arguments.products.report.is_some() && merged.summary.is_weighted() {
        return Err("--report: shows studies in which every trial counts alike, and these are of rare robots".into());
    }
    let tables: Vec<&Path> = merged.shards.iter().map(PathBuf::as_path).collect();
    let document = study_json(&merged.summary, merged.extent);
    arguments.products.make(&tables, &document)?;
    drop(waiting);
    if arguments.json {
        print_json(&document)?;
    } else {
        print_answer(study_text(&merged.summary, merged.extent))?;
    }
    Ok(Outcome::Done)
}
