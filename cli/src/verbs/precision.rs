//! `sim precision SCENARIO`: the precision test of the TriCal, and its budget.

use std::path::PathBuf;

use crate::arguments::choices::seed;
use crate::arguments::scenario::read_scenario;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print_answer, print_json};
use crate::terminal::progress::Trials;
use calibench::files::with_reasons;
use calibench_lab::precision::{PrecisionError, Setup, Source, budget, carry_out, precision_json, precision_text};
use calibench_sim::random::Streams;
use calibench_sim::scenario::MOST_REPETITIONS;
use calibench_sim::scenario::Scenario;

/// Largest number of tests in a budget: its bands are then below one per cent.
const MOST_TRIALS: u64 = 100_000;

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file
    scenario: PathBuf,
    /// Number of times the datum ball is centred and measured, overriding the scenario's
    #[arg(long, value_parser = repetitions, allow_negative_numbers = true)]
    repetitions: Option<usize>,
    /// Number of tests from which the budget is computed
    #[arg(long, default_value = "500", value_parser = trials, allow_negative_numbers = true)]
    trials: u64,
    /// Seed that replaces the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

fn repetitions(text: &str) -> Result<usize, String> {
    let wanted = format!("give a whole number from 1 to {MOST_REPETITIONS}");
    text.parse().ok().filter(|n| (1..=MOST_REPETITIONS).contains(n)).ok_or(wanted)
}

fn trials(text: &str) -> Result<u64, String> {
    let wanted = format!("give a whole number from 2 to {MOST_TRIALS}");
    text.parse().ok().filter(|n| (2..=MOST_TRIALS).contains(n)).ok_or(wanted)
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let scenario = read_scenario(&arguments.scenario)?;
    let mut setup = Setup::of(&scenario);
    setup.repetitions = arguments.repetitions.unwrap_or(setup.repetitions);
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let locate = |error: PrecisionError| located(&scenario, &error);
    let test = carry_out(&setup, &Streams { seed, trial: 0 }).map_err(locate)?;
    let bar = Trials::new(1 + 2 * Source::ALL.len());
    let budget = budget(&setup, seed, arguments.trials, &|| bar.done()).map_err(locate)?;
    drop(bar);
    if arguments.json {
        print_json(&precision_json(&scenario.name, seed, &setup, &test, &budget))?;
    } else {
        print_answer(precision_text(&scenario.name, seed, &setup, &test, &budget))?;
    }
    Ok(Outcome::Done)
}

/// Attributes an error to the table of the scenario that caused it.
fn located(scenario: &Scenario, error: &PrecisionError) -> Failure {
    let (key, remedy) = match error {
        PrecisionError::Mastering(_) => ("truth.indicators", "give the indicators smaller flaws"),
        PrecisionError::Arm(_) => ("precision", "give the small arm smaller flaws"),
        PrecisionError::Centring { .. } => ("precision", "give the small arm finer steps, or widen centring.tolerance_um"),
    };
    Box::new(scenario.wrong(key, with_reasons(error), remedy))
}
