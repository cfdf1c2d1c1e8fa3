//! `add EFFECT DATASET... [--model M] [-o MODEL]`.

use std::path::PathBuf;

use calibench::assess::{Objection, ProvingGround, WorkspacePoses, rung};
use calibench::identify::{Use, write_model, write_model_like};
use calibench::report::{added_sentences, objection_sentence, parameter_rows, rung_table, step_json, symptom_sentence};

use super::progress::Waiting;
use super::{
    Failure, Outcome, blame_data, check_datasets, check_outputs, gate, model_for, named, print, print_json, read_datasets,
    warn_of_poses,
};
use crate::step::{StepError, Wanted};

#[derive(clap::Args)]
pub struct Arguments {
    /// Effect to add, as `effects` lists it; `base_step`, `tool_step`, `joint_step:J`, `harmonic:J` and `outlier` without their moment,
    /// order or sample take the one that fits best; `curve:J:VARIABLE` is the curve of joint J over q1, tau2, q2+q3, time_s ...
    effect: String,
    /// Dataset folders: one robot; each session in each has its own base and tool
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// Model file, rewritten in place; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long)]
    model: Option<PathBuf>,
    /// Where to write the new model in place of the old one's file; a file that is there is replaced
    #[arg(short, long, visible_alias = "out")]
    output: Option<PathBuf>,
    /// Campaigns that are not fitted: a step that makes one worse is refused
    #[arg(long, num_args = 1.., value_name = "DATASET")]
    check: Vec<PathBuf>,
    /// Take the step even if it is refused, and go on with data that do not fit their robot
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(arguments.output.as_ref().or(arguments.model.as_ref()))?;
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_for(arguments.model.as_deref(), &datasets)?;
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    let named = named(&datasets);
    let wanted = Wanted::parse(&arguments.effect, &model, &named)?;
    let checks = check_datasets(&arguments.check, &datasets)?;
    let checks = super::named(&checks);
    let poses = WorkspacePoses::of(&named);
    let ground = ProvingGround { poses: &poses.q, checks: &checks };
    let blame = |e| blame_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let waiting = Waiting::new("fitting");
    let before = rung(&named, &model, ground).map_err(blame)?;
    let after = wanted.take(&named, &before, ground).map_err(|e| -> Failure {
        match e {
            StepError::Effect(_) => Box::new(e),
            // It is the data that lack something, not the model's file.
            StepError::Data(e) => Box::new(blame_data(&arguments.datasets, &datasets, None, &e)),
            StepError::Model(e) => Box::new(blame(e)),
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
    let added = after.added.join(" ");
    if arguments.json {
        let mut document = step_json(&before, &after, &objections, accepted);
        gate.mark(&mut document);
        print_json(&document)?;
    } else {
        gate.misfit.iter().try_for_each(|sentence| print(sentence))?;
        print(&rung_table(&[&before, &after]))?;
        print(&format!("\nFOUND: {added}\n{}", parameter_rows(&after.calibration, &after.added)))?;
        added_sentences(&after.added, &[&before]).iter().try_for_each(|sentence| print(sentence))?;
        for symptom in after.symptoms.iter().filter(|s| !before.symptoms.iter().any(|b| b.parameter == s.parameter)) {
            print(&symptom_sentence(symptom))?;
        }
        for objection in &objections {
            let weight = if objection.refuses() { "Against it" } else { "Note" };
            print(&format!("{weight}: {}.", objection_sentence(objection)))?;
        }
        match (target, accepted) {
            (Some(path), true) => print(&format!("Taken. The model with {added} is in {}.", path.display()))?,
            (None, true) => print("Taken. Name a file with -o to keep the model.")?,
            (_, false) => {}
        }
    }
    warn_of_poses(&after.calibration, &poses);
    if accepted {
        return Ok(Outcome::Done);
    }
    let why: Vec<String> = objections.iter().filter(|o| o.refuses()).map(objection_sentence).collect();
    let untouched = arguments.model.as_ref().map_or(String::new(), |m| format!("; {} is untouched", m.display()));
    eprintln!("calibench: {added} is refused: {}{untouched}; --force takes the step all the same", why.join("; "));
    Ok(Outcome::ExpectationFailed)
}
