//! `plan next DATASET... [--model M] [--scenario S] -o PLAN`.

use std::path::{Path, PathBuf};

use calibench::diagnosis::{Examination, diagnose_examined};
use calibench::identify::problem::Use;
use calibench::measure::dataset::Dataset;
use calibench::planning::designer::Criterion;
use calibench::planning::planned::planned_for;
use calibench::planning::pool::CellLayout;
use calibench::planning::propose;
use calibench::prediction::WorkspacePoses;
use calibench::selection::hold_out::HoldOut;
use calibench::units::MM;
use calibench_report::{documents, lacking_sentence, next_sentences, next_table, planned_sentence};

use crate::arguments::choices::seed;
use crate::arguments::data::{dataset, locate_in_data, model_of, named, read_datasets};
use crate::arguments::data_gate::gate;
use crate::arguments::scenario::read_scenario;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print, print_answer, print_detail, print_json};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::{input, output};
use calibench_sim::planning::{layout, retreat};
use calibench_workbench::{WrittenProposal, write_proposal};

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders of one robot; the next measurements are for the first set-up of the first
    #[arg(required = true, value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Model file to plan for; the default is the one that `ladder` recommends from the paper's model: base_frame, mdh,
    /// joint_compliance
    #[arg(long, value_parser = input())]
    model: Option<PathBuf>,
    /// Scenario of the cell, for the bodies in it; without it only robot and balls are known
    #[arg(long)]
    scenario: Option<PathBuf>,
    /// Output file for the poses of the best probing action (TOML), and beside it, if they are better still, the points of a
    /// tracker (CSV); existing files are replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Seed of the candidate postures
    #[arg(long, value_parser = seed, default_value = "1", allow_negative_numbers = true)]
    seed: u64,
    /// Continue with data that do not fit the robot
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

/// Largest distance between two positions of the same ball, m: a CMM certificate is better, and a wrong scenario is decimetres
/// off.
const SAME_PLACE: f64 = 1.0 * MM;

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_of(arguments.model.as_deref(), &arguments.datasets, &datasets)?;
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    let locate = |e| locate_in_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let first = &datasets[0].1;
    let (layout, reference) = match &arguments.scenario {
        Some(path) => of_scenario(path, first)?,
        None => (CellLayout::of_dataset(first), first.robot_reference.clone()),
    };
    let named = named(&datasets);
    let waiting = Waiting::new("diagnosing");
    // A model given explicitly is used as it is.
    let planned = match &arguments.model {
        Some(_) => None,
        None => {
            let at = WorkspacePoses::of(&named);
            Some(planned_for(&named, &model, HoldOut { poses: &at, checks: &[], worker: None }).map_err(locate)?)
        }
    };
    let model = planned.as_ref().map_or(&model, |p| &p.ladder_step().model);
    let examination = Examination::new(&named, model).map_err(locate)?;
    let diagnosis = diagnose_examined(&named, &examination).map_err(locate)?;
    waiting.begin("designing");
    let proposal = propose(&named, &examination, &diagnosis, &layout, arguments.seed).map_err(locate)?;
    drop(waiting);
    print_detail(match proposal.criterion {
        Criterion::Discrimination => "chosen to distinguish the effects in question",
        _ => "chosen for accuracy over the workspace",
    });
    let written = match &arguments.output {
        Some(path) => write_proposal(path, &proposal, &reference, Some((&layout, retreat())))?,
        None => WrittenProposal::default(),
    };
    if arguments.json {
        let mut document = documents::Next::of(&proposal);
        document.cell_known = Some(layout.is_known);
        document.written = Some(written.words);
        document.planned_for = planned.as_ref().map(planned_sentence);
        document.recommended = planned.as_ref().map(|planned| documents::Recommended::of(&planned.ladder));
        document.misfit = gate.misfit;
        print_json(&document)?;
        return Ok(Outcome::Done);
    }
    gate.misfit.iter().try_for_each(|sentence| print_answer(sentence))?;
    if let Some(event) = lacking_sentence(&diagnosis).filter(|_| diagnosis.by_row_order.is_some()) {
        print_answer(event)?;
        print_answer(
            "Give the rows their times first (`calibrate --every 30s`): no further pose helps against what happened.",
        )?;
    }
    print(next_table(&proposal))?;
    planned.iter().try_for_each(|p| print(planned_sentence(p)))?;
    for sentence in next_sentences(&proposal) {
        if sentence.is_answer { print_answer(sentence.text) } else { print(sentence.text) }?;
    }
    for not in &proposal.not_offered {
        print(format!("Not offered: {}: {}.", not.what, not.because))?;
    }
    if !layout.is_known {
        let balls = if datasets.iter().all(|(_, d)| d.balls.is_empty()) { "" } else { " and balls" };
        print(format!(
            "Nothing but the robot{balls} is known to be in the cell: inspect every pose before it is driven, or name a scenario."
        ))?;
    }
    written.words.iter().try_for_each(|line| print_answer(line))?;
    Ok(Outcome::Done)
}

/// Reads the cell of a scenario, which must be that of the dataset, and its reference to the robot.
fn of_scenario(path: &Path, dataset: &Dataset) -> Result<(CellLayout, String), Failure> {
    let scenario = read_scenario(path)?;
    let cell = scenario.dataset();
    if !cell.robot.is_same_arm(&dataset.robot) {
        let problem = format!("is '{}', but the dataset's robot is '{}'", cell.robot.name, dataset.robot.name);
        return Err(scenario.wrong("robot", problem, "name the scenario of the cell in which the data were taken").into());
    }
    let same = |b: usize| {
        let (here, there) = (&cell.balls[b], &dataset.balls[b]);
        here.id == there.id && (here.position - there.position).norm() < SAME_PLACE
    };
    if cell.balls.len() != dataset.balls.len() || !(0..cell.balls.len()).all(same) {
        let problem = "are not those of the dataset";
        return Err(scenario.wrong("ball", problem, "name the scenario of the cell in which the data were taken").into());
    }
    Ok((layout(&scenario), cell.robot_reference.clone()))
}
