//! `merge SHARD...`: the shards of a study put together.

use std::path::{Path, PathBuf};

use super::progress::Waiting;
use super::study_tables::{Products, study_json, study_text};
use super::{Failure, Outcome, check_outputs, print, print_json};
use crate::study::merge;

#[derive(clap::Args)]
pub struct Arguments {
    /// Tables that `study` wrote, of one study, in any order; one alone is told about
    #[arg(required = true)]
    shards: Vec<PathBuf>,
    /// Table of all of them (CSV): the bytes that one run would have written
    #[arg(short, long, visible_alias = "out")]
    output: Option<PathBuf>,
    #[command(flatten)]
    products: Products,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(arguments.output.iter().chain(arguments.products.files()))?;
    let waiting = Waiting::new("reading");
    let merged = merge(&arguments.shards, arguments.output.as_deref())?;
    let tables: Vec<&Path> = merged.shards.iter().map(PathBuf::as_path).collect();
    let document = study_json(&merged.summary, merged.extent);
    arguments.products.make(&tables, &document)?;
    drop(waiting);
    if arguments.json {
        print_json(&document)?;
    } else {
        print(&study_text(&merged.summary, merged.extent))?;
    }
    Ok(Outcome::Done)
}
