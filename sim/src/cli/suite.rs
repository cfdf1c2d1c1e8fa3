//! `suite SCENARIO`: the blind trials of the diagnosis.

use std::path::PathBuf;

use calibench::files::write_whole;
use calibench::report::plain_table;
use serde_json::json;

use super::progress::Trials;
use super::suite_tables::suite_text;
use super::{Failure, Outcome, print, print_json, seed};
use crate::run::Plans;
use crate::scenario::{Scenario, load_scenario};
use crate::suite::{cases, designs, run as run_cases, tally};

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file with a [suite]
    scenario: PathBuf,
    /// Only so many trials
    #[arg(long)]
    trials: Option<usize>,
    /// Take every n-th trial only: a small suite with a bit of everything
    #[arg(long, default_value_t = 1)]
    every: usize,
    /// Where to write the table of trials (CSV); a file that is there is replaced
    #[arg(short, long, visible_alias = "out")]
    output: Option<PathBuf>,
    /// Instead, try so many robots whose diagnosis may be ambiguous, and measure those again as designed, D-optimal and at random
    #[arg(long)]
    designs: Option<usize>,
    /// Seed in place of the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let scenario = load_scenario(&arguments.scenario)?;
    let Some(spec) = &scenario.suite else {
        return Err(Box::new(scenario.wrong("suite", "is missing", "give a [suite] of blind trials")));
    };
    let seed = arguments.seed.unwrap_or(scenario.seed);
    if let Some(trials) = arguments.designs {
        return compare_designs(&scenario, seed, trials, arguments);
    }
    let plans = Plans::new(&scenario, seed).map_err(|e| scenario.blame_plan(&e))?;
    let mut all: Vec<_> = cases(&scenario, spec).into_iter().step_by(arguments.every.max(1)).collect();
    all.truncate(arguments.trials.unwrap_or(usize::MAX));
    let bar = Trials::new(all.len());
    let outcomes = run_cases(&scenario, &plans, &all, seed, &|| bar.done())?;
    drop(bar);
    if let Some(path) = &arguments.output {
        let mut table = csv::Writer::from_writer(Vec::new());
        outcomes.iter().try_for_each(|o| table.serialize(o))?;
        write_whole(path, &table.into_inner().map_err(|e| e.into_error())?)?;
    }
    let tally = tally(&outcomes);
    if arguments.json {
        print_json(&json!({"format": "calibench-suite/1", "scenario": scenario.name, "seed": seed, "tally": tally}))?;
    } else {
        print(&suite_text(&tally))?;
    }
    Ok(Outcome::Done)
}

fn compare_designs(scenario: &Scenario, seed: u64, trials: usize, arguments: &Arguments) -> Result<Outcome, Failure> {
    let bar = Trials::new(trials);
    let rows = designs(scenario, seed, trials, &|| bar.done())?;
    drop(bar);
    if arguments.json {
        print_json(&json!({"format": "calibench-designs/1", "scenario": scenario.name, "seed": seed, "rows": rows}))?;
        return Ok(Outcome::Done);
    }
    let share = |v: f64| format!("{v:.2}");
    let table: Vec<[String; 7]> = rows
        .iter()
        .map(|r| {
            let more = format!("+{}", r.measurements);
            [r.pool.into(), r.criterion.into(), more, share(r.truth), share(r.top_right), share(r.resolved), share(r.expected)]
        })
        .collect();
    let cases = rows.first().map_or(0, |r| r.cases);
    print(&format!("{cases} of {trials} robots were found to miss something, but not surely or not rightly named\n"))?;
    let header = ["measured more", "chosen", "measurements", "P(truth)", "named first", "resolved", "resolved, as expected"];
    print(&plain_table(&header, &table))?;
    Ok(Outcome::Done)
}
