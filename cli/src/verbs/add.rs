//! `add EFFECT DATASET... [--model M] [-o MODEL]`.

use std::path::PathBuf;

use calibench::files::streams::{is_standard_input, is_standard_output};
use calibench::identify::model_file::{write_model, write_model_like};
use calibench::identify::problem::Use;
use calibench::prediction::WorkspacePoses;
use calibench::selection::Objection;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::ladder_step;
use calibench_report::{
    Printout, Recommended, added_sentences, called, disagreement_sentence, documents, ladder_step_table, objection_sentence,
    parameter_rows, symptom_sentence,
};
use calibench_workbench::{StepError, Wanted};

use crate::arguments::data::{
    check_datasets, dataset, locate_in_data, model_of, named, read_datasets, tell_fit, warn_of_poses,
};
use crate::arguments::data_gate::gate;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print, print_answer, print_json, tell};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::{input, output};

#[derive(clap::Args)]
pub struct Arguments {
    /// Effect to add, as listed by `effects`; `base_step`, `tool_step`, `joint_step:J`, `harmonic:J` and `outlier` without
    /// their moment, order or sample take the one that fits best; `curve:J:VARIABLE` is the curve of joint J over q1, tau2,
    /// q2+q3, time_s ...
    effect: String,
    /// Dataset folders of one robot; each session in each has its own base and tool
    #[arg(required = true, value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Model file, updated in place; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long, value_parser = input())]
    model: Option<PathBuf>,
    /// Output file for the new model, which leaves the old one's file unchanged; an existing file is replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Campaigns not included in the fit: a step that makes one worse is refused
    #[arg(long, num_args = 1.., value_name = "DATASET", value_parser = dataset())]
    check: Vec<PathBuf>,
    /// Take the step even if it is refused, and continue with data that do not fit their robot
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if arguments.output.is_none() && arguments.model.as_deref().is_some_and(is_standard_input) {
        return Err("--model: `-` cannot be updated in place; name the new model's file with -o (or `-o -`)".into());
    }
    check_outputs(arguments.output.as_ref().or(arguments.model.as_ref()))?;
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_of(arguments.model.as_deref(), &arguments.datasets, &datasets)?;
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    let named = named(&datasets);
    let wanted = Wanted::parse(&arguments.effect, &model, &named)?;
    let checks = check_datasets(&arguments.check, &datasets)?;
    let checks = crate::arguments::data::named(&checks);
    let poses = WorkspacePoses::of(&named);
    let ground = HoldOut { poses: &poses, checks: &checks, worker: None };
    let locate = |e| locate_in_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let waiting = Waiting::new("fitting");
    let before = ladder_step(&named, &model, ground).map_err(locate)?;
    let after = wanted.take(&named, &before, ground).map_err(|e| -> Failure {
        match e {
            StepError::Effect(_) => Box::new(e),
            // The data are deficient, not the model file.
            StepError::Data(e) => Box::new(locate_in_data(&arguments.datasets, &datasets, None, &e)),
            StepError::Model(e) => Box::new(locate(e)),
        }
    })?;
    drop(waiting);
    let objections = after.objections(&before);
    let refused = objections.iter().any(Objection::refuses);
    let accepted = !refused || arguments.force;
    let target = arguments.output.as_deref().or(arguments.model.as_deref());
    if let Some(path) = target.filter(|_| accepted) {
        match &arguments.model {
            Some(like) => write_model_like(&after.model, like, path)?,
            None => write_model(&after.model, path)?,
        }
    }
    let found = after.added.iter().map(|effect| called(&after.model.registry, effect)).collect::<Vec<_>>().join("; ");
    tell_fit(&after.calibration);
    if arguments.json {
        let document = documents::Step::of(&before, &after, &objections, accepted);
        print_json(&documents::Step { misfit: gate.misfit, ..document })?;
    } else {
        gate.misfit.iter().try_for_each(|sentence| print_answer(sentence))?;
        print_answer(ladder_step_table(&[&before, &after]))?;
        print(Printout::from(format!("\nFOUND: {found}\n")) + parameter_rows(&after.calibration, &after.added))?;
        added_sentences(&after.added, &[&before]).iter().try_for_each(|sentence| print(sentence))?;
        for symptom in after.symptoms.iter().filter(|s| !before.symptoms.iter().any(|b| b.parameter == s.parameter)) {
            print(symptom_sentence(symptom))?;
        }
        for objection in &objections {
            let weight = if objection.refuses() { "Against it" } else { "Note" };
            print_answer(format!("{weight}: {}.", objection_sentence(objection)))?;
        }
        match (target, accepted) {
            (Some(path), true) => print_answer(format!("Added. The model with {found} is in {}.", path.display()))?,
            (None, true) => print_answer("Added. Name a file with -o to keep the model.")?,
            (_, false) => {}
        }
    }
    let beyond = warn_of_poses(&after.calibration, &poses);
    if !arguments.json {
        disagreement_sentence(&after, beyond.outside).iter().try_for_each(|sentence| print(sentence))?;
        print(format!("Verdict with it: {}.", after.diagnosis.verdict.in_words()))?;
        let goes_on = accepted && !after.diagnosis.verdict.is_noise();
        if let Some(path) = target.filter(|path| goes_on && !is_standard_output(path)) {
            print_answer(format!(
                "Next: `{}` says what else is missing.",
                Recommended::of(&arguments.datasets, Some(path)).diagnose()
            ))?;
        }
    }
    if accepted {
        return Ok(Outcome::Done);
    }
    let why: Vec<String> = objections.iter().filter(|o| o.refuses()).map(objection_sentence).collect();
    let untouched = arguments.model.as_ref().map_or(String::new(), |m| format!("; {} is untouched", m.display()));
    tell(format!("calibench: {found} is refused: {}{untouched}; --force takes the step anyway", why.join("; ")));
    Ok(Outcome::ExpectationFailed)
}
