//! `diagnose DATASET... [--model M]`.

use std::path::PathBuf;

use calibench::assess::diagnose;
use calibench::report::{diagnosis_json, diagnosis_text};

use super::{Failure, Outcome, blame_data, model_for, named, print, print_json, read_datasets};

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders: one robot; each session in each has its own base and tool
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// Model file; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long)]
    model: Option<PathBuf>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_for(arguments.model.as_deref(), &datasets)?;
    let blame = |e| blame_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let diagnosis = diagnose(&named(&datasets), &model).map_err(blame)?;
    if arguments.json { print_json(&diagnosis_json(&diagnosis))? } else { print(&diagnosis_text(&diagnosis))? }
    Ok(Outcome::Done)
}
