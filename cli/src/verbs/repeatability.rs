//! `cell repeatability SCENARIO|--cell CELL`: repeatability of the robot and lost motion of its joints on reversal, measured with
//! the gauge.

pub(super) mod cell;

use std::path::PathBuf;

use calibench::measure::campaign::repeatability::RepeatabilitySettings;
use serde_json::json;

use self::cell::{Asked, CellArguments, at_cell, places};
use crate::arguments::choices::PlantChoice;
use crate::arguments::choices::seed;
use crate::arguments::scenario::read_scenario;
use crate::tables::repeatability::{Whose, repeatability_json, repeatability_text};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print_answer, print_json};
use crate::terminal::progress::Waiting;
use calibench::files::with_reasons;
use calibench_sim::random::Streams;
use calibench_sim::repeatability::{RepeatabilityError, Visited, stations, visit};
use calibench_sim::run::RunError;
use calibench_sim::scenario::{PlantKind, Scenario};

/// Largest number of returns, reversals or postures: so many make a visit last a day.
const MOST: usize = 1000;

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file
    #[arg(required_unless_present = "cell", conflicts_with = "cell")]
    scenario: Option<PathBuf>,
    #[command(flatten)]
    cell: CellArguments,
    /// Ball to return to, by its id; may be repeated; the default is every ball
    #[arg(long, value_name = "ID")]
    ball: Vec<String>,
    /// Number of postures on each ball
    #[arg(long, default_value = "1", value_parser = from_one, allow_negative_numbers = true)]
    postures: usize,
    /// Number of returns to each posture; ISO 9283 requires 30
    #[arg(long, default_value = "30", value_parser = from_two, allow_negative_numbers = true)]
    returns: usize,
    /// Number of arrivals of each joint from each side, at each posture
    #[arg(long, default_value = "10", value_parser = from_two, allow_negative_numbers = true)]
    reversals: usize,
    /// Seed that replaces the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true, conflicts_with = "cell")]
    seed: Option<u64>,
    /// Plant that simulates the mechanics of the cell, overriding the scenario's choice
    #[arg(long, value_enum, conflicts_with = "cell")]
    plant: Option<PlantChoice>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

fn from_one(text: &str) -> Result<usize, String> {
    count(text, 1)
}

fn from_two(text: &str) -> Result<usize, String> {
    count(text, 2)
}

fn count(text: &str, least: usize) -> Result<usize, String> {
    let wanted = format!("give a whole number from {least} to {MOST}");
    text.parse().ok().filter(|n| (least..=MOST).contains(n)).ok_or(wanted)
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let Arguments { returns, reversals, postures, .. } = *arguments;
    let settings = RepeatabilitySettings { returns, reversals, ..RepeatabilitySettings::default() };
    if let (Some(path), Some(plan)) = (&arguments.cell.cell, &arguments.cell.plan) {
        let asked = Asked { settings: &settings, named: &arguments.ball, postures };
        let (cell, visited) = at_cell(path, plan, &arguments.cell, &asked)?;
        let (path, balls) = (path.display().to_string(), cell.dataset.ball_ids());
        let whose = Whose { name: format!("cell '{path}'"), keys: vec![("cell", json!(path))], balls: &balls };
        return print_result(arguments.json, &whose, &visited);
    }
    let Some(path) = &arguments.scenario else { return Err("give a scenario, or --cell CELL with --plan PLAN".into()) };
    let mut scenario = read_scenario(path)?;
    scenario.expect_trical("cell repeatability")?;
    scenario.plant = arguments.plant.map_or(scenario.plant, PlantKind::from);
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let balls = places(&scenario.ball_ids(), &arguments.ball)?;
    let waiting = Waiting::new("choosing postures");
    let locate = |error: RepeatabilityError| located(&scenario, error);
    let stations = stations(&scenario, &balls, postures, seed).map_err(locate)?;
    waiting.begin("going back to them");
    let visited = visit(&scenario, Streams { seed, trial: 0 }, &stations, &settings).map_err(locate)?;
    drop(waiting);
    let keys = vec![("scenario", json!(scenario.name)), ("plant", json!(scenario.plant.name())), ("seed", json!(seed))];
    let whose = Whose { name: format!("scenario '{}', seed {seed},", scenario.name), keys, balls: &scenario.ball_ids() };
    print_result(arguments.json, &whose, &visited)
}

fn print_result(as_json: bool, whose: &Whose<'_>, visited: &Visited) -> Result<Outcome, Failure> {
    if as_json {
        print_json(&repeatability_json(whose, visited))?;
    } else {
        print_answer(repeatability_text(whose, visited))?;
    }
    Ok(Outcome::Done)
}

/// Attributes an error to the key of the scenario that caused it.
fn located(scenario: &Scenario, error: RepeatabilityError) -> Failure {
    let problem = with_reasons(&error);
    let key_and_remedy = match error {
        RepeatabilityError::Plan(error) => return Box::new(scenario.locate_plan(&error)),
        RepeatabilityError::Session(error) => return Box::new(scenario.locate(&RunError::Session(error))),
        RepeatabilityError::TooFewPostures { .. } => ("plan", "request fewer with --postures, or widen plan.cone_deg"),
        RepeatabilityError::Visit { .. } => ("truth", "make the injected errors smaller, or retreat further"),
    };
    Box::new(scenario.wrong(key_and_remedy.0, problem, key_and_remedy.1))
}
