//! `sim study SCENARIO`: the whole procedure repeated, with every error sampled again.

use std::path::PathBuf;
use std::time::Instant;

use serde_json::json;
use toml::Value;

use crate::arguments::choices::{MethodChoice, PlantChoice, seed};
use crate::arguments::scenario::read_document;
use crate::tables::study::Products;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print_answer, print_json};
use crate::terminal::progress::{Trials, Waiting};
use calibench_lab::study::{Extent, RowsFile, Study, Summary, run as run_trials, study_json, study_text};
use calibench_sim::scenario::PlantKind;
use calibench_sim::scenario::{Document, KeyError};

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file; with a [sweep] the study is made at each of its points
    scenario: PathBuf,
    /// Number of trials at each point
    #[arg(long)]
    trials: u64,
    /// Number of the first trial: shards of any size, on any machine, combine to the bytes of one run
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Output table of the trials (CSV), one row per trial, point and method; an interrupted study continues where it stopped
    #[arg(short, long, visible_alias = "out")]
    output: Option<PathBuf>,
    #[command(flatten)]
    products: Products,
    /// Methods of which every trial has a row; what the other would have measured is left out
    #[arg(long, value_enum, default_value = "both")]
    method: MethodChoice,
    /// Diagnose every trial as well
    #[arg(long)]
    diagnose: bool,
    /// Look for the worst robots: sample them more often, weight every trial accordingly, and report the errors that this share of all
    /// robots stay within, e.g. 0.999
    #[arg(long, value_name = "SHARE", value_parser = rare_share)]
    rare: Option<f64>,
    /// Plant that simulates the mechanics of the cell, overriding the scenario's choice
    #[arg(long, value_enum)]
    plant: Option<PlantChoice>,
    /// Seed that replaces the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    arguments.products.expect()?;
    check_outputs(arguments.output.iter().chain(arguments.products.files()))?;
    let Arguments { trials, first, output, products, .. } = arguments;
    let extent = extent(*first, *trials)?;
    if products.parquet.is_some() && output.is_none() {
        return Err("--parquet: is made from the table of trials; name that too, with -o".into());
    }
    if arguments.rare.is_some() && arguments.diagnose {
        return Err("--rare: estimates errors, not verdicts; leave out --diagnose".into());
    }
    if arguments.rare.is_some() && products.report.is_some() {
        return Err("--report: shows studies in which every trial counts alike; leave out --rare".into());
    }
    let study = prepare(arguments)?;
    let header = csv::Reader::from_reader(&study.columns.header()[..]).headers()?.clone();
    let mut summary = Summary::new(&header).ok_or("the table has the columns of a study")?;
    let file = output.as_ref().map(|path| RowsFile::open(path, &study, extent, |row| summary.add(row))).transpose()?;
    let points = study.points.len() as u64;
    let bar = Trials::new((trials * points) as usize);
    let found = file.as_ref().map_or(0, |f| f.found);
    bar.begin_at(found * points);
    let begun = Instant::now();
    run_trials(&study, extent, file, |lines| summary.add_lines(lines), &|| bar.done())?;
    let seconds = begun.elapsed().as_secs_f64();
    drop(bar);
    let tables: Vec<&std::path::Path> = output.iter().map(PathBuf::as_path).collect();
    let mut document = study_json(&summary, extent);
    document["question"] = json!(study.points[0].scenario.question);
    products.make(&tables, &document)?;
    if arguments.json {
        let run_now = (trials - found) * points;
        document["trials_per_second"] = if run_now > 0 { json!(run_now as f64 / seconds) } else { json!(null) };
        print_json(&document)?;
    } else {
        print_answer(study_text(&summary, extent))?;
    }
    Ok(Outcome::Done)
}

/// The trials requested.
fn extent(first: u64, trials: u64) -> Result<Extent, String> {
    if !(1..=Extent::END).contains(&trials) {
        return Err(format!("--trials: is out of range; give a number from 1 to {}", Extent::END));
    }
    let most = Extent::END - trials;
    if first > most {
        return Err(format!("--first: is out of range; with --trials {trials} give a number from 0 to {most}"));
    }
    Ok(Extent { first, trials })
}

/// Plans the requested study.
fn prepare(arguments: &Arguments) -> Result<Study, Failure> {
    let mut document = read_document(&arguments.scenario)?;
    let change =
        |document: &mut Document, key: &str, value: Value| -> Result<(), KeyError> { document.set(&key.parse()?, value) };
    if let Some(seed) = arguments.seed {
        let seed =
            i64::try_from(seed).map_err(|_| format!("--seed: a study takes seeds up to {}; give a smaller one", i64::MAX))?;
        change(&mut document, "seed", Value::Integer(seed))?;
    }
    if let Some(plant) = arguments.plant {
        change(&mut document, "plant", Value::String(PlantKind::from(plant).name().into()))?;
    }
    let waiting = Waiting::new("planning");
    let begun = |point: usize, plans: usize| waiting.now(format!("planning point {}, {plans} plans so far", point + 1));
    let study = Study::new(&document, arguments.method.into(), arguments.diagnose, &begun)?;
    Ok(match arguments.rare {
        Some(share) => {
            waiting.now("finding the rare robots");
            study.of_rare(share)?
        }
        None => study,
    })
}

/// A share of robots, of which the others are rare.
fn rare_share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.9..=0.999_999).contains(&share) => Ok(share),
        _ => Err("give a share from 0.9 to 0.999999".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_option_that_is_out_of_range_is_named_with_its_limit() {
        assert_eq!(extent(0, 1), Ok(Extent { first: 0, trials: 1 }));
        assert_eq!(extent(Extent::END - 2, 2), Ok(Extent { first: Extent::END - 2, trials: 2 }));
        for (first, trials, says) in [
            (0, 0, "--trials: is out of range; give a number from 1 to 4611686018427387904"),
            (0, u64::MAX, "--trials: is out of range; give a number from 1 to 4611686018427387904"),
            (u64::MAX, 2, "--first: is out of range; with --trials 2 give a number from 0 to 4611686018427387902"),
            (Extent::END - 1, 2, "--first: is out of range; with --trials 2 give a number from 0 to 4611686018427387902"),
        ] {
            assert_eq!(extent(first, trials), Err(says.to_owned()));
        }
    }
}
