//! `diagnose DATASET... [--model M]`.

use std::path::PathBuf;

use calibench::assess::{Examination, Relevance, WORKSPACE_POSES, WorkspaceError, diagnose_examined, workspace_poses};
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
    let named = named(&datasets);
    let examination = Examination::new(&named, &model).map_err(blame)?;
    let diagnosis = diagnose_examined(&named, &examination).map_err(blame)?;
    let relevance = Relevance::new(&examination)?;
    let poses = match std::env::var("POSES") {
        Ok(p) => calibench::measure::read_dataset(std::path::Path::new(&p))?.samples.iter().map(|s| s.q.clone()).collect(),
        Err(_) => workspace_poses(&datasets[0].1, WORKSPACE_POSES),
    };
    if let Some(w) = WorkspaceError::predict(&named, &examination, &relevance, &poses).map_err(blame)? {
        eprintln!("workspace mean {:?} max {:?}", w.mean, w.max);
    }
    if arguments.json {
        print_json(&diagnosis_json(&diagnosis))?
    } else {
        print(&diagnosis_text(&diagnosis))?
    }
    Ok(Outcome::Done)
}
