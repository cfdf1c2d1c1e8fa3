//! `discover DATASET... [--model M] [-o MODEL]`.

use std::path::PathBuf;

use calibench::identify::model_file::{write_model, write_model_like};
use calibench::identify::problem::Use;
use calibench::prediction::WorkspacePoses;
use calibench::selection::Objection;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{LadderStep, ladder_step, step};
use calibench_discover::discover;
use calibench_report::{
    Recommended, documents, ladder_step_table, law_sentences, listed_sentence, no_law_sentence, objection_sentence,
    suspected_sentences,
};

use crate::arguments::data::{dataset, locate_in_data, model_of, named, read_datasets, tell_fit};
use crate::arguments::data_gate::gate;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print, print_answer, print_json};
use crate::terminal::progress::Stages;
use crate::terminal::streams::{input, output};

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders of one robot
    #[arg(required = true, value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Model file, whose residuals are searched; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long, value_parser = input())]
    model: Option<PathBuf>,
    /// Output file for the model with the laws that were found; an existing file is replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Continue with data that do not fit their robot
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of sentences
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_of(arguments.model.as_deref(), &arguments.datasets, &datasets)?;
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    let named = named(&datasets);
    let locate = |e| locate_in_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let robot = &datasets[0].1.robot;
    let bar = Stages::new(2);
    bar.begin("searching");
    let found = discover(&named, &model).map_err(locate)?;
    let larger = found.added_to(&model);
    bar.begin("judging what was found");
    let poses = WorkspacePoses::of(&named);
    let ground = HoldOut { poses: &poses, checks: &[], worker: None };
    let mut judged: Option<[LadderStep; 2]> = None;
    if !larger.added.is_empty() {
        let before = ladder_step(&named, &model, ground).map_err(locate)?;
        let after = step(&named, &before, &larger.model, larger.added.clone(), ground).map_err(locate)?;
        judged = Some([before, after]);
    }
    drop(bar);
    let objections = judged.as_ref().map_or_else(Vec::new, |[before, after]| after.objections(before));
    let accepted = !objections.iter().any(Objection::refuses);
    if let (Some(path), true, true) = (&arguments.output, accepted, judged.is_some()) {
        match &arguments.model {
            Some(like) => write_model_like(&larger.model, like, path)?,
            None => write_model(&larger.model, path)?,
        }
    }
    judged.iter().for_each(|[_, after]| tell_fit(&after.calibration));
    if arguments.json {
        let of = |[before, after]: &[LadderStep; 2]| documents::Step::of(before, after, &objections, accepted);
        let document = documents::Discovery::of(&found, &larger.laws, robot, judged.as_ref().map(of));
        print_json(&documents::Discovery { misfit: gate.misfit, ..document })?;
        return Ok(if accepted { Outcome::Done } else { Outcome::ExpectationFailed });
    }
    gate.tell()?;
    for (law, name) in found.laws.iter().zip(&larger.laws) {
        let mut sentences = law_sentences(law, robot).into_iter();
        sentences.next().iter().try_for_each(|first| print_answer(format!("{name}: {first}")))?;
        sentences.try_for_each(|sentence| print(format!("  {sentence}")))?;
    }
    listed_sentence(&found).iter().chain(&no_law_sentence(&found)).try_for_each(|sentence| print_answer(sentence))?;
    suspected_sentences(&found, robot).iter().try_for_each(|sentence| print(format!("  {sentence}")))?;
    let Some([before, after]) = &judged else { return Ok(Outcome::Done) };
    print(ladder_step_table(&[before, after]))?;
    for objection in &objections {
        let weight = if objection.refuses() { "Against it" } else { "Note" };
        print_answer(format!("{weight}: {}.", objection_sentence(objection)))?;
    }
    print(format!("Verdict with it: {}.", after.diagnosis.verdict.in_words()))?;
    match (&arguments.output, accepted) {
        (Some(path), true) => {
            let next = Recommended::of(&arguments.datasets, Some(path)).diagnose();
            print_answer(format!("The model with it is in {}. Next: `{next}` says what else is missing.", path.display()))?;
        }
        (None, true) => print_answer("Name a file with -o to keep the model.")?,
        (_, false) => print_answer("It is not taken: the model is unchanged.")?,
    }
    Ok(if accepted { Outcome::Done } else { Outcome::ExpectationFailed })
}
