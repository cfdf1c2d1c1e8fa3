//! `ladder DATASET... [--model M] [--check DATASET...]`.

use std::convert::Infallible;
use std::ops::ControlFlow;
use std::path::PathBuf;

use calibench::diagnosis::Verdict;
use calibench::effects::registry::Registry;
use calibench::identify::model_file::{write_model, write_model_like};
use calibench::identify::problem::Use;
use calibench::prediction::WorkspacePoses;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{LadderProgress, LadderStep, observed_ladder};
use calibench::selection::recommend::ChoiceKind;
use calibench_report::{
    NoForecast, Recommended, added_sentences, advice, choices_text, disagreement_sentence, documents, each_called,
    fleet_sentence, in_question_sentence, ladder_step_sentence, ladder_step_table, not_added_sentence, symptom_sentence,
    top_sentences,
};

use crate::arguments::data::{
    check_datasets, dataset, locate_in_data, model_of, named, read_datasets, tell_fit, warn_of_poses, with_fleet,
};
use crate::arguments::data_gate::gate;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, is_detailed, print, print_answer, print_detail, print_json};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::{input, output};

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders of one robot; each session in each has its own base and tool
    #[arg(required = true, value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Initial model file; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long, value_parser = input())]
    model: Option<PathBuf>,
    /// What robots of this type have in common, made by `keep fleet`: it is taken into account unless this robot is not like them
    #[arg(long, value_parser = input())]
    fleet: Option<PathBuf>,
    /// Campaigns not included in the fit: base and tool are re-estimated in each, and a step that makes one worse is refused
    #[arg(long, num_args = 1.., value_name = "DATASET", value_parser = dataset())]
    check: Vec<PathBuf>,
    /// Output file for the recommended model (TOML), in the layout of --model; an existing file is replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Write the model with the field of joint errors, or with the whole library if only balls were measured, whatever is
    /// recommended
    #[arg(long, requires = "output")]
    whole: bool,
    /// Continue with data that do not fit their robot
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_of(arguments.model.as_deref(), &arguments.datasets, &datasets)?;
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    let checks = check_datasets(&arguments.check, &datasets)?;
    let checks = crate::arguments::data::named(&checks);
    let (model, fleet) = with_fleet(model, arguments.fleet.as_deref(), &datasets)?;
    let named = named(&datasets);
    let poses = WorkspacePoses::of(&named);
    let ground = HoldOut { poses: &poses, checks: &checks, worker: None };
    let waiting = Waiting::new("diagnosing");
    let ladder = observed_ladder(&named, &model, ground, &mut |progress| {
        tell_progress(&waiting, &model.registry, &progress);
        ControlFlow::<Infallible>::Continue(())
    });
    drop(waiting);
    let ControlFlow::Continue(ladder) =
        ladder.map_err(|e| locate_in_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e))?;
    let chosen = ladder.recommended();
    let written = if arguments.whole {
        let of_kind = |kind| ladder.recommendation.of_kind(kind);
        let none = "there is no model of all errors at once: nothing is missing, or these data do not carry one";
        &of_kind(ChoiceKind::Field).or_else(|| of_kind(ChoiceKind::Library)).ok_or(none)?.model
    } else {
        &chosen.model
    };
    if let Some(path) = &arguments.output {
        match &arguments.model {
            Some(like) => write_model_like(written, like, path)?,
            None => write_model(written, path)?,
        }
    }
    tell_fit(&chosen.calibration);
    let beyond = warn_of_poses(&chosen.calibration, &poses);
    if arguments.json {
        let outside_range = documents::OutsideRange::of(&beyond);
        print_json(&documents::Ladder {
            outside_range,
            misfit: gate.misfit,
            fleet: fleet.as_ref().map(documents::FleetUsed::of),
            ..documents::Ladder::of(&ladder)
        })?;
        return Ok(Outcome::Done);
    }
    gate.tell()?;
    fleet.iter().try_for_each(|judged| print(fleet_sentence(judged)))?;
    print(ladder_step_table(&ladder.steps.iter().chain(&ladder.other).collect::<Vec<&LadderStep>>()))?;
    let steps: Vec<&LadderStep> = ladder.steps.iter().collect();
    for (k, ladder_step) in steps.iter().enumerate() {
        added_sentences(&ladder_step.added, &steps[..k]).iter().try_for_each(|sentence| print(sentence))?;
    }
    for sentence in top_sentences(&ladder.top, ladder.last(), &Recommended::of(&arguments.datasets, arguments.model.as_deref()))
    {
        print(sentence)?;
    }
    for check in &chosen.checks {
        if let Err(because) = &check.result {
            print(format!("Check {} cannot be judged: {because}.", check.name))?;
        }
    }
    for symptom in &chosen.symptoms {
        print(symptom_sentence(symptom))?;
    }
    if chosen.workspace.is_none() {
        print(NoForecast::of(&chosen.undetermined).to_string())?;
    }
    if is_detailed() {
        print_detail(choices_text(&ladder));
    }
    disagreement_sentence(chosen, beyond.outside).iter().try_for_each(|sentence| print(sentence))?;
    print_answer(advice(&ladder))?;
    let commands = Recommended::of(&arguments.datasets, arguments.model.as_deref());
    in_question_sentence(&ladder, &commands).iter().try_for_each(|sentence| print_answer(sentence))?;
    if matches!(chosen.diagnosis.verdict, Verdict::Unexplained | Verdict::Partly) {
        print("What remains may follow a law that nobody listed: `calibench discover` searches for one.")?;
    }
    if let Some(path) = &arguments.output {
        let which = if arguments.whole { "model of all errors at once" } else { "recommended model" };
        print_answer(format!("The {which} is in {}.", path.display()))?;
    }
    Ok(Outcome::Done)
}

/// Prints one line per step, accepted or refused, on standard error.
fn tell_progress(waiting: &Waiting, registry: &Registry, progress: &LadderProgress<'_>) {
    let say = |line: String| waiting.say(&line);
    match progress {
        LadderProgress::Trying(effects) => waiting.now(format!("trying {}", each_called(registry, effects))),
        // In the end all refusals are reported together.
        LadderProgress::Refused(step) if is_detailed() => say(format!("  {}", not_added_sentence(registry, step, 1))),
        LadderProgress::Reached(ladder_step) => {
            say(ladder_step_sentence(ladder_step));
            if is_detailed() {
                ladder_step.symptoms.iter().for_each(|s| say(format!("  {}", symptom_sentence(s))));
            }
            waiting.now("looking for the next step");
        }
        LadderProgress::Refused(..) => {}
        LadderProgress::Choosing => waiting.begin("choosing between the steps and a model of all errors at once"),
    }
}
