//! `sim suite SCENARIO`: the blind trials of the diagnosis.

use std::path::PathBuf;

use calibench::files::disk::write_whole;
use calibench_report::plain_table;
use serde_json::json;

use crate::arguments::choices::seed;
use crate::arguments::scenario::read_scenario;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print_answer, print_json};
use crate::terminal::progress::Trials;
use crate::terminal::streams::output;
use calibench_lab::suite::{
    Advice, Case, FIRST_REPORTING_SEED, Suite, class_rows, classes_text, designs, reliability, reliability_text, suite_text,
    tally,
};
use calibench_sim::scenario::Scenario;

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file with a [suite] table
    scenario: PathBuf,
    /// Only trials of these classes, by name or, if no class has that name, by its beginning (`unknown`); they are the same as
    /// in the whole suite
    #[arg(long, num_args = 1.., value_name = "CLASS")]
    class: Vec<String>,
    /// Largest number of trials of each class
    #[arg(long, value_name = "TRIALS")]
    each: Option<usize>,
    /// Follow the ladder's recommendation, not only the first finding of the diagnosis: many times slower
    #[arg(long)]
    advice: bool,
    /// Largest total number of trials
    #[arg(long)]
    trials: Option<usize>,
    /// Take only every n-th trial: a small suite with a bit of everything
    #[arg(long, default_value_t = 1)]
    every: usize,
    /// Output file for the table of trials (CSV); an existing file is replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Number of robots to try instead: those with an ambiguous diagnosis are measured again as designed, D-optimally and at
    /// random
    #[arg(long)]
    designs: Option<usize>,
    /// Seed that replaces the scenario's: below 1001 for development, from 1001 on for reported results
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    let scenario = read_scenario(&arguments.scenario)?;
    scenario.expect_trical("sim suite")?;
    let Some(spec) = &scenario.suite else {
        return Err(Box::new(scenario.wrong("suite", "is missing", "give a [suite] of blind trials")));
    };
    let seed = arguments.seed.unwrap_or(scenario.seed);
    if let Some(trials) = arguments.designs {
        return compare_designs(&scenario, seed, trials, arguments);
    }
    let suite = Suite::new(&scenario, spec)?;
    let chosen = chosen(&suite, arguments)?;
    let planned = suite.plan(&chosen, seed).map_err(|e| e.error)?;
    let bar = Trials::new(chosen.len());
    let advice = if arguments.advice { Advice::Ladder } else { Advice::Diagnosis };
    let outcomes = planned.run(&chosen, advice, &|| bar.done())?;
    drop(bar);
    if let Some(path) = &arguments.output {
        let mut table = csv::Writer::from_writer(Vec::new());
        outcomes.iter().try_for_each(|o| table.serialize(o))?;
        write_whole(path, &table.into_inner().map_err(|e| e.into_error())?)?;
    }
    let (tally, rows) = (tally(&outcomes), class_rows(&outcomes));
    let followed = if arguments.advice { "ladder" } else { "diagnosis" };
    if arguments.json {
        print_json(&json!({
            "format": "calibench-suite/1", "scenario": scenario.name, "seed": seed, "for_reporting": seed >= FIRST_REPORTING_SEED,
            "advice": followed, "classes": rows, "tally": tally, "reliability": reliability(&outcomes),
        }))?;
    } else {
        if seed < FIRST_REPORTING_SEED {
            print_answer(format!("Seed {seed} is for development: report figures of seeds from {FIRST_REPORTING_SEED} on.\n"))?;
        }
        print_answer(classes_text(&rows, arguments.advice))?;
        print_answer(suite_text(&tally))?;
        print_answer(reliability_text(&reliability(&outcomes)))?;
    }
    Ok(Outcome::Done)
}

/// The requested cases.
fn chosen(suite: &Suite, arguments: &Arguments) -> Result<Vec<Case>, Failure> {
    let known = suite.classes();
    let mut of_classes: Vec<&str> = Vec::new();
    for class in &arguments.class {
        let named: Vec<&str> = known.iter().filter(|k| *k == class).copied().collect();
        let begin = known.iter().filter(|k| k.strip_prefix(class.as_str()).is_some_and(|rest| rest.starts_with('_'))).copied();
        let named = if named.is_empty() { begin.collect() } else { named };
        if named.is_empty() {
            let list = known.join(", ");
            return Err(format!("--class {class}: there is no such class; those of this suite are {list}").into());
        }
        of_classes.extend(named);
    }
    let asked = |case: &&Case| {
        let of_class = arguments.class.is_empty() || of_classes.contains(&case.class.as_str());
        of_class && arguments.each.is_none_or(|each| case.place < each)
    };
    let mut all: Vec<Case> = suite.cases().iter().filter(asked).step_by(arguments.every.max(1)).cloned().collect();
    all.truncate(arguments.trials.unwrap_or(usize::MAX));
    Ok(all)
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
    print_answer(format!("{cases} of {trials} robots were found to miss something, but not surely or not rightly named\n"))?;
    let header = ["measured more", "chosen", "measurements", "P(truth)", "named first", "resolved", "resolved, as expected"];
    print_answer(plain_table(header, table))?;
    Ok(Outcome::Done)
}
