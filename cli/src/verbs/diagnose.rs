//! `diagnose DATASET... [--model M]`.

use std::path::PathBuf;

use calibench::diagnosis::Diagnosis;
use calibench::identify::fit::Outcome as FitOutcome;
use calibench::identify::problem::Use;
use calibench::prediction::WorkspacePoses;
use calibench::selection::Advice;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::ladder_step;
use calibench_report::{
    Forecast, NoForecast, Printout, Recommended, abnormal_sentences, diagnosis_tables, documents, fleet_sentence,
    next_step_sentences, sentences,
};

use crate::arguments::data::{dataset, locate_in_data, model_of, named, read_datasets, tell_fit, warn_of_poses, with_fleet};
use crate::arguments::data_gate::gate;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print, print_answer, print_json};
use crate::terminal::progress::Stages;
use crate::terminal::streams::input;

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders of one robot; each session in each has its own base and tool
    #[arg(required = true, value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Model file; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long, value_parser = input())]
    model: Option<PathBuf>,
    /// What robots of this type have in common, made by `keep fleet`: it is taken into account unless this robot is not like them
    #[arg(long, value_parser = input())]
    fleet: Option<PathBuf>,
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
    let model = model_of(arguments.model.as_deref(), &arguments.datasets, &datasets)?;
    let locate = |e| locate_in_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    let (model, fleet) = with_fleet(model, arguments.fleet.as_deref(), &datasets)?;
    let named = named(&datasets);
    let poses = WorkspacePoses::of(&named);
    let ground = HoldOut { poses: &poses, checks: &[], worker: None };
    let bar = Stages::new(2);
    bar.begin("fitting the model, testing every effect");
    let mut step = ladder_step(&named, &model, ground).map_err(locate)?;
    if gate.misfit.is_some() {
        step.diagnosis.doubt();
    }
    bar.begin("judging the next step");
    let advice = Advice::on(&named, &step, ground).map_err(locate)?;
    drop(bar);
    tell_fit(&step.calibration);
    let commands = Recommended::of(&arguments.datasets, arguments.model.as_deref());
    let beyond = warn_of_poses(&step.calibration, &poses);
    let diagnosis = &step.diagnosis;
    let forecast = match &step.workspace {
        Some(error) => Ok(Forecast { error: error.clone(), extrapolation: beyond }),
        None => Err(NoForecast::of(&step.undetermined)),
    };
    if arguments.json {
        let document = documents::Diagnosis::of(diagnosis, forecast.as_ref().ok());
        let advice = Some(documents::Advised::of(&advice, diagnosis, &commands));
        print_json(&documents::Diagnosis {
            misfit: gate.misfit,
            fleet: fleet.as_ref().map(documents::FleetUsed::of),
            advice,
            ..document
        })?;
    } else {
        abnormal_sentences(&diagnosis.abnormal).iter().try_for_each(|sentence| print_answer(sentence))?;
        gate.tell()?;
        fleet.iter().try_for_each(|judged| print(fleet_sentence(judged)))?;
        tell(diagnosis, &forecast, &advice, &commands)?;
        print(Printout::from("\n") + diagnosis_tables(diagnosis, arguments.heat_map))?;
    }
    Ok(if diagnosis.outcome == FitOutcome::Converged { Outcome::Done } else { Outcome::ExpectationFailed })
}

/// The diagnosis in words; what is expected of the robot and what to do next are part of the answer.
fn tell(
    diagnosis: &Diagnosis,
    forecast: &Result<Forecast, NoForecast>,
    advice: &Advice,
    commands: &Recommended,
) -> Result<(), Failure> {
    // What is abnormal has been said.
    for sentence in sentences(diagnosis).into_iter().skip(diagnosis.abnormal.len()) {
        if sentence.is_answer { print_answer(sentence.text) } else { print(sentence.text) }?;
    }
    print_answer(forecast.as_ref().map_or_else(NoForecast::to_string, Forecast::sentence))?;
    next_step_sentences(advice, diagnosis, commands).iter().try_for_each(|sentence| print_answer(sentence))
}
