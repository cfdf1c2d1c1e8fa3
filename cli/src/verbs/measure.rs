//! `measure SCENARIO -o DATASET`: probes the balls of the simulated cell; with `--cell CELL`, those of a real one.

mod by_hand;
pub(super) mod cell;
pub(super) mod devices;
mod points;
pub(super) mod rehearsal;

use std::path::{Path, PathBuf};

use calibench::diagnosis::diagnose;
use calibench::files::disk::check_output_folder;
use calibench::files::with_reasons;
use calibench::measure::campaign::cell::read_cell;
use calibench::measure::campaign::journal::{Journal, JournalSession, OpenedJournal};
use calibench::measure::campaign::{Abort, CampaignObserver, CampaignRecord, CampaignSettings, Conditions, parts_by_payload};
use calibench::measure::dataset::file::{DATASET_TOML, read_dataset};
use calibench::measure::dataset::{Dataset, NamedDataset, Sample, SampleSet};
use calibench::measure::poses::{PlannedPose, ProbingPlan, read_plan};
use calibench::planning::{Adaptive, LOOKS};
use calibench::units::MM;
use calibench_report::{EXPECTED_OVER, Recommended, finds_nothing, lacking_sentence};

use self::cell as measure_cell;
use crate::arguments::choices::PlantChoice;
use crate::arguments::choices::seed;
use crate::arguments::choosing::{Choice, Chosen, finished};
use crate::arguments::data::model_for;
use crate::arguments::scenario::{read_document, read_scenario};
use crate::terminal::failure::{Failure, Interrupted, Outcome, PROBINGS};
use crate::terminal::output::{print_answer, warn};
use crate::terminal::progress::{CampaignBar, Waiting};
use crate::terminal::streams::input;
use calibench_sim::planning::{PlanError, Tour, plan, plan_tracker};
use calibench_sim::plans::session_s;
use calibench_sim::random::Streams;
use calibench_sim::run::RunError;
use calibench_sim::scenario::PlantKind;
use calibench_sim::scenario::Scenario;
use calibench_sim::session::{Session, centring};

/// Three forms of call; clap's generated usage would merge them.
const USAGE: &str = "calibench measure <SCENARIO> --output <DATASET> [OPTIONS]
       calibench measure --cell <CELL> --plan <PLAN> --output <DATASET> [OPTIONS]
       calibench measure --by-hand <STATION> --output <TABLE> [--robot <ROBOT>] [--resume]";

/// Change of temperature during an adaptive campaign that is reported, K: a gear's error changes by some urad per kelvin.
const TELLING_K: f64 = 1.0;

#[derive(clap::Args)]
#[command(override_usage = USAGE)]
pub struct Arguments {
    /// Scenario file
    #[arg(required_unless_present_any = ["cell", "by_hand"], conflicts_with_all = ["cell", "by_hand"])]
    scenario: Option<PathBuf>,
    /// Output folder for the dataset, which must not exist (with `--by-hand`, a table); until it is complete, DATASET.journal
    /// beside it holds the measurements
    #[arg(short, long, visible_alias = "out", value_name = "DATASET", required_unless_present = "dry_run")]
    output: Option<PathBuf>,
    /// Resume an interrupted campaign from its journal; start it if there is none
    #[arg(long)]
    resume: bool,
    /// Plan file written by `plan`; the default is a new plan
    #[arg(long, value_parser = input())]
    plan: Option<PathBuf>,
    /// Seed that replaces the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true, conflicts_with = "cell")]
    seed: Option<u64>,
    /// Plant that simulates the mechanics of the cell, overriding the scenario's choice
    #[arg(long, value_enum, conflicts_with = "cell")]
    plant: Option<PlantChoice>,
    /// Which visit to the simulated cell this is: 0 is the first; later ones find the same robot, artifact and gauge, and make
    /// new noise
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "cell")]
    visit: u64,
    /// Measure no more than needed: until the mean position error over the workspace is below this, mm, with a probability of
    /// 90 %; the next poses are those that reduce it most
    #[arg(long, value_name = "MM", value_parser = until)]
    until_mm: Option<f64>,
    /// With `--until-mm`, the model to identify; the default model of the data without it
    #[arg(long, value_name = "MODEL", requires = "until_mm", value_parser = input())]
    model: Option<PathBuf>,
    /// Station file: somebody jogs the robot, the program reads its joints from the controller and the points from the
    /// instrument
    #[arg(long, value_name = "STATION", value_parser = input(), conflicts_with_all = ["cell", "plan", "seed", "plant", "visit", "until_mm"])]
    by_hand: Option<PathBuf>,
    /// With `--by-hand`, the robot: a name, a robot file or a URDF; every eight postures it is said how far its nominal model is off
    #[arg(long, requires = "by_hand")]
    robot: Option<String>,
    #[command(flatten)]
    real: measure_cell::CellArguments,
}

fn until(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("'{text}' is not a number"))?;
    (0.001..=10.0).contains(&value).then_some(value).ok_or_else(|| "give an error from 0.001 to 10 mm".to_owned())
}

/// A campaign in a simulated cell.
pub struct Simulated<'a> {
    /// The scenario's file.
    pub scenario: &'a Path,
    /// The plan; a new one is made without it.
    pub plan: Option<&'a Path>,
    /// The dataset.
    pub output: &'a Path,
    /// Seed that replaces the scenario's.
    pub seed: Option<u64>,
    /// Plant that replaces the scenario's.
    pub plant: Option<PlantChoice>,
    /// Number of the visit.
    pub visit: u64,
    /// True if an interrupted campaign goes on.
    pub resume: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if let Some(station) = &arguments.by_hand {
        let output = arguments.output.as_deref().ok_or("say where to write the table: -o TABLE.csv")?;
        return by_hand::run(station, arguments.robot.as_deref(), output, arguments.resume);
    }
    let Some(until_mm) = arguments.until_mm else { return run_with(arguments, Choice::default()) };
    // Whether the plan changes the payload is known of a plan, and of the scenario that is planned again.
    let (cell, light_poses) = match (&arguments.real.cell, &arguments.scenario) {
        (Some(cell), _) => (read_cell(cell)?.dataset, 0),
        (None, Some(scenario)) => {
            let scenario = read_scenario(scenario)?;
            scenario.expect_trical("measure")?;
            let cell = Dataset { contact_force: scenario.indicators.contact_force(), ..scenario.dataset() };
            (cell, scenario.plan.light_poses)
        }
        (None, None) => return Err("name a scenario and an output, or a cell and a plan".into()),
    };
    let several = match &arguments.plan {
        Some(plan) => parts_by_payload(&read_plan(plan, &cell)?.poses).len() > 1,
        None => light_poses > 0,
    };
    if several {
        return Err(
            "--until-mm: the plan changes the payload; plan a campaign with one, and measure the other separately".into()
        );
    }
    let named = [(String::new(), cell)];
    let model = model_for(arguments.model.as_deref(), &named)?;
    let [(_, cell)] = named;
    let mut adaptive = Adaptive::new(&cell, &model, until_mm * MM);
    let mut failure = None;
    let mut choose = |waiting: &[&PlannedPose], samples: &[Sample]| -> Option<usize> {
        adaptive.next(waiting, samples).unwrap_or_else(|e| {
            failure.get_or_insert_with(|| with_reasons(&e));
            Some(0)
        })
    };
    let under = vec![("until_mm", until_mm.to_string()), ("until_model", format!("{model:?}"))];
    let outcome = run_with(arguments, Choice { choose: Some(&mut choose), silent: false, under })?;
    let (Outcome::Done, Some(output), false) = (&outcome, &arguments.output, arguments.real.dry_run) else {
        return Ok(outcome);
    };
    let measured = read_dataset(output)?;
    if let Err(e) = adaptive.judge(&measured.samples) {
        failure.get_or_insert_with(|| with_reasons(&e));
    }
    if let Some(why) = failure {
        warn(&format!("warning: the poses were measured in the order of the plan, to its end: {why}"));
    }
    let waiting = Waiting::new("diagnosing");
    let diagnosis = diagnose(&[NamedDataset::new("campaign", &measured)], &model);
    drop(waiting);
    print_answer(reached_sentence(&adaptive, until_mm))?;
    if let Some(sentence) = warming_sentence(&measured.samples) {
        print_answer(sentence)?;
    }
    let diagnosis = diagnosis.as_ref().ok();
    if let Some(sentence) = diagnosis.and_then(lacking_sentence) {
        let commands = Recommended::of(std::slice::from_ref(output), arguments.model.as_deref());
        print_answer(format!("{sentence} Next: `{}` shows more.", commands.diagnose()))?;
    } else if !adaptive.is_enough() && diagnosis.is_some_and(finds_nothing) {
        print_answer("The diagnosis finds nothing that the model lacks: more poses, or less noise, are needed.")?;
    }
    Ok(if adaptive.is_enough() { outcome } else { Outcome::ExpectationFailed })
}

/// The precision reached by an adaptive campaign, in a sentence.
fn reached_sentence(adaptive: &Adaptive, until_mm: f64) -> String {
    let Some(last) = adaptive.reached().last() else {
        return format!("The samples are too few to say whether {until_mm} mm are reached.");
    };
    let [expected, low, high] = [last.mean.expected, last.mean.low, last.mean.high].map(|x| x / MM);
    let said =
        format!("{}: {expected:.3} mm ({low:.3} to {high:.3}, 10 to 90 %) after {} probings", EXPECTED_OVER.name, last.samples);
    if adaptive.is_enough() {
        return format!("Enough: {said}; below {until_mm} mm with a probability of 90 %, by {LOOKS} predictions in a row.");
    }
    let alone = if high <= until_mm { ", but those a few probings before were larger" } else { "" };
    format!("All poses are measured, and {until_mm} mm are not reached: {said}{alone}.")
}

/// A remark on a campaign whose samples differ in temperature.
fn warming_sentence(samples: &[Sample]) -> Option<String> {
    let temperatures = || samples.iter().filter_map(|sample| sample.temp_c);
    let (low, high) = (temperatures().reduce(f64::min)?, temperatures().reduce(f64::max)?);
    (high - low >= TELLING_K).then(|| {
        format!(
            "It was measured from {low:.1} to {high:.1} °C: the error to expect is that within these temperatures; let the arm warm up, or measure over all those at which it will work."
        )
    })
}

fn run_with(arguments: &Arguments, choice: Choice<'_>) -> Result<Outcome, Failure> {
    let Arguments { scenario, output, resume, plan: plan_file, real, .. } = arguments;
    match (scenario, output, &real.cell, plan_file) {
        (_, output, Some(cell), Some(plan)) => measure_cell::run(cell, real, plan, output.as_deref(), *resume, choice),
        (Some(scenario), Some(output), ..) => {
            let Arguments { seed, plant, visit, .. } = *arguments;
            let plan = plan_file.as_deref();
            simulate(&Simulated { scenario, plan, output, seed, plant, visit, resume: *resume }, choice)
        }
        // The command-line parser ensures that they are given.
        _ => Err("name a scenario and an output, or a cell and a plan".into()),
    }
}

/// Probes the balls of a simulated cell.
pub fn simulate(arguments: &Simulated<'_>, choice: Choice<'_>) -> Result<Outcome, Failure> {
    let Simulated { scenario, output, visit, .. } = *arguments;
    check_output_folder(output, "dataset", DATASET_TOML)?;
    let document = read_document(scenario)?;
    let mut scenario = document.scenario()?;
    scenario.expect_trical("measure")?;
    scenario.plant = arguments.plant.map_or(scenario.plant, PlantKind::from);
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let cell = scenario.dataset();
    let waiting = Waiting::new("planning");
    let planned = match arguments.plan {
        Some(path) => read_plan(path, &cell)?,
        None => plan(&scenario, seed).map_err(|e| scenario.locate_plan(&e))?.probing,
    };
    let poses = &planned.poses;
    // The plan file holds poses on balls; if the tracker adds points, the scenario states how many.
    let home = planned.ways.as_ref().map(|ways| ways.home.as_slice());
    let points = if scenario.plan.point_poses > 0 {
        plan_tracker(&scenario, seed, home).map_err(|e| scenario.locate_plan(&PlanError::Tracker(Box::new(e))))?.points
    } else {
        Tour::default()
    };
    drop(waiting);
    let cell = Dataset { contact_force: scenario.indicators.contact_force(), ..cell };
    // The scenario represents all that is hidden in the cell.
    let text = document.text_without(&["question", "expect", "suite", "design", "seed", "plant"]);
    let under = Conditions::of(poses, &cell)
        .and_text("scenario", &text)
        .and("seed", seed)
        .and("visit", visit)
        .and("plant", scenario.plant.name())
        .and_settings("centring", &centring(&scenario))
        .and_settings("campaign", &CampaignSettings::default());
    let under = choice.on(under);
    let silent = choice.silent;
    let mut journal = match Journal::open(output, &under, arguments.resume)? {
        OpenedJournal::Ready(journal) => *journal,
        OpenedJournal::Finished { probings } => {
            if !silent {
                print_answer(finished(probings, output))?;
            }
            return Ok(Outcome::Done);
        }
        // A simulated cell has no guards of its own.
        OpenedJournal::Changed { what } => return Err(format!("{}: {}", output.display(), what.join("; ")).into()),
        other => return Err(format!("{}: the campaign cannot go on from {other:?}", output.display()).into()),
    };
    journal.live_through_again();
    let mut observer = Chosen { bar: CampaignBar::new(planned.wanted()), choose: choice.choose, watch: None };
    let visit = Visit { streams: Streams { seed, trial: 0 }, number: visit };
    let measured = measure(&scenario, &visit, &planned, &points, &mut journal, &mut observer);
    drop(observer);
    let interrupted = |why: String, journal: &Journal| Interrupted {
        why,
        what: PROBINGS,
        kept: journal.probings(),
        journal: journal.path().into(),
    };
    let (record, points) = match measured {
        Ok(measured) => measured,
        Err(RunError::Campaign(Abort::NotJournalled { why })) => return Err(interrupted(why, &journal).into()),
        // The same cell would end the campaign in the same way again.
        Err(e) => {
            journal.discard()?;
            return Err(scenario.locate(&e).into());
        }
    };
    let summary = format!(
        "{} of {} planned probings{} measured; dataset in {}",
        record.samples.len(),
        planned.wanted(),
        if points.is_empty() { String::new() } else { format!(" and {} points", points.len()) },
        output.display()
    );
    let dataset = Dataset { samples: record.samples.iter().cloned().chain(points).collect(), ..cell };
    journal.finish(&dataset, &record, poses).map_err(|e| interrupted(e.to_string(), &journal))?;
    if !silent {
        print_answer(summary)?;
    }
    Ok(Outcome::Done)
}

/// A visit to a simulated cell.
struct Visit {
    /// Random streams of the cell.
    streams: Streams,
    /// Its number.
    number: u64,
}

fn measure(
    scenario: &Scenario,
    visit: &Visit,
    plan: &ProbingPlan,
    points: &Tour,
    journal: &mut Journal,
    observer: &mut dyn CampaignObserver,
) -> Result<(CampaignRecord, Vec<Sample>), RunError> {
    let session_s = session_s(scenario, &plan.poses, points.poses.len());
    let session = Session::visit(scenario, visit.streams, session_s, visit.number, |_| ())?;
    let began = journal.begin_session(JournalSession::first(session.mastering().clone()));
    began.map_err(|e| Abort::NotJournalled { why: e.to_string() })?;
    let record = session.probe(plan, Some(journal), observer);
    if let Some(abort) = record.aborted {
        return Err(abort.into());
    }
    let mut tracked = Vec::new();
    if !points.poses.is_empty() {
        let tracker = session.set_up_tracker()?;
        tracked = session.points(&tracker, points, "t", SampleSet::Fit)?.samples;
    }
    Ok((record, tracked))
}
