//! `diagnose DATASET... [--model M]`.

use std::path::PathBuf;

use calibench::assess::{Examination, WorkspacePoses, diagnose_examined};
use calibench::identify::{Outcome as FitOutcome, Use};
use calibench_report::{diagnosis_text, documents, extrapolation_sentence};

use super::data::{forecast, locate_in_data, model_for, named, read_datasets, recommended};
use super::data_gate::gate;
use super::failure::{Failure, Outcome};
use super::output::{print, print_json};
use super::progress::Stages;

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders of one robot; each session in each has its own base and tool
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// Model file; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long)]
    model: Option<PathBuf>,
    /// Show which variable each joint's error follows, even if an effect of the catalogue explains it
    #[arg(long)]
    heat_map: bool,
    /// Continue with data that do not fit the robot; the result says so
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_for(arguments.model.as_deref(), &datasets)?;
    let locate = |e| locate_in_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    let named = named(&datasets);
    let bar = Stages::new(3);
    bar.begin("fitting the model");
    let examination = Examination::new(&named, &model).map_err(locate)?;
    bar.begin("testing every effect");
    let diagnosis = diagnose_examined(&named, &examination).map_err(locate)?;
    bar.begin("predicting the error over the workspace");
    let forecast = forecast(&named, &examination, &WorkspacePoses::of(&named)).map_err(locate)?;
    drop(bar);
    if let Some(warning) = forecast.as_ref().ok().and_then(|o| extrapolation_sentence(&o.extrapolation)) {
        eprintln!("{warning}");
    }
    let commands = recommended(&arguments.datasets, arguments.model.as_deref());
    if arguments.json {
        let document = documents::Diagnosis::of(&diagnosis, forecast.as_ref().ok(), &commands);
        print_json(&documents::Diagnosis { misfit: gate.misfit, ..document })?
    } else {
        gate.tell()?;
        print(&diagnosis_text(&diagnosis, &forecast, &commands, arguments.heat_map))?
    }
    Ok(if diagnosis.outcome == FitOutcome::Converged { Outcome::Done } else { Outcome::ExpectationFailed })
}
