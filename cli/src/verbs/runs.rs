//! `keep runs DATASET... [--model M] [-o CALIBRATION]`: many runs of one robot; what stayed, what moved, what belongs to one run only.

use std::path::PathBuf;

use calibench::files::with_reasons;
use calibench::identify::Model;
use calibench::identify::calibration::write_calibration;
use calibench::identify::problem::{Problem, Use};
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::monitoring::runs::tables::EffectStatus;
use calibench::monitoring::runs::{Run, RunsComparison, RunsError, RunsQuestion, RunsVerdict, set_suspects_aside};
use calibench::residuals::noise::Suspect;
use calibench_report::{documents, runs_answer, runs_text};
use jiff::civil::Date;

use super::prove::thin;
use crate::arguments::data::{dataset, locate_in_data, model_of, read_datasets};
use crate::arguments::data_gate::gate;
use crate::terminal::failure::{Failure, LocatedError, Outcome};
use crate::terminal::output::{check_outputs, is_told, note, print_answer, print_json, warn};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::{input, output};

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders, one a run of the robot; of a single folder, every session is a run
    #[arg(required = true, value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Model file; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long, value_parser = input())]
    model: Option<PathBuf>,
    /// Dates of the runs, YYYY-MM-DD, in the order of the folders; the default is `provenance.date` of each dataset
    #[arg(long, value_delimiter = ',', value_name = "DATE")]
    dates: Vec<Date>,
    /// A parameter that may drift, with one sigma of its change in a month in its own unit: `theta2=0.01`; repeat for several
    #[arg(long, value_name = "PARAMETER=SIZE")]
    drift: Vec<String>,
    /// Output file for the calibration of the robot as it is in the last run (TOML); an existing file is replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Largest number of rows used of each run, spread over it
    #[arg(long, value_name = "ROWS", value_parser = clap::value_parser!(u32).range(1..))]
    at_most: Option<u32>,
    /// Do not predict every run from the others
    #[arg(long)]
    no_prediction: bool,
    /// Continue with data that do not fit their robot
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    let mut datasets = by_session(read_datasets(&arguments.datasets)?);
    if let Some(rows) = arguments.at_most {
        datasets.iter_mut().for_each(|(_, dataset)| thin(dataset, rows as usize, Use::Fit));
    }
    let dates = dates(arguments, &datasets)?;
    let mut order: Vec<usize> = (0..datasets.len()).collect();
    if dates.iter().all(Option::is_some) {
        order.sort_by_key(|&k| dates[k]);
        if !order.is_sorted() {
            let names: Vec<&str> = order.iter().map(|&k| datasets[k].0.as_str()).collect();
            note(&format!("In the order of their dates: {}.", names.join(", ")));
        }
    } else {
        note("Not every run has a date: the order is that of the command line, and drifts are not estimated.");
    }
    let mut datasets: Vec<(String, Dataset)> = order.iter().map(|&k| datasets[k].clone()).collect();
    let dates: Vec<Option<Date>> = order.iter().map(|&k| dates[k]).collect();
    let model = model_of(arguments.model.as_deref(), &arguments.datasets, &datasets)?;
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    for (run, Suspect { sample, deviation, .. }) in set_suspects_aside(&mut datasets, &model) {
        warn(&format!("warning: {run}: {sample} is excluded: it is {deviation:.0} sigma from what all others of this run say"));
    }
    let drifts = drifts(&arguments.drift, &datasets, &model)?;
    let day = |date: &Option<Date>| date.map(|d| f64::from(d.since(Date::ZERO).map_or(0, |span| span.get_days())));
    let runs: Vec<Run<'_>> =
        datasets.iter().zip(&dates).map(|((name, dataset), date)| Run { name, dataset, day: day(date) }).collect();
    let question = RunsQuestion { runs: &runs, model: &model, drifts: &drifts, left_out: !arguments.no_prediction };
    let waiting = Waiting::new("comparing runs");
    let compared = RunsComparison::of(question, &mut |now| waiting.now(now.to_owned()));
    let located = |e: RunsError| located(arguments, &datasets, e);
    let compared = compared.map_err(located)?;
    let several = compared.verdict == RunsVerdict::Several;
    let calibration = match &arguments.output {
        Some(_) if !several => Some(compared.calibration(question).map_err(located)?),
        _ => None,
    };
    drop(waiting);
    let said: Vec<Option<String>> = dates.iter().map(|d| d.map(|d| d.to_string())).collect();
    if let (Some(path), Some(calibration)) = (&arguments.output, &calibration) {
        write_calibration(calibration, path)?;
    }
    if arguments.json {
        print_json(&documents::Runs::of(&compared, &said))?;
    } else {
        gate.tell()?;
        if is_told() {
            print_answer(runs_text(&compared, &said))?;
        } else {
            print_answer(runs_answer(&compared))?;
        }
        match (&arguments.output, &calibration) {
            (Some(path), Some(_)) => {
                print_answer(format!("The robot as it is in {} is in {}.", datasets[datasets.len() - 1].0, path.display()))?;
            }
            (Some(_), None) => print_answer("No calibration is written: no one geometry explains these runs.")?,
            _ => {}
        }
    }
    let refused = compared.effects.iter().any(|e| matches!(e.status, EffectStatus::OnlyIn(_)));
    Ok(if several || refused { Outcome::ExpectationFailed } else { Outcome::Done })
}

/// Of a single dataset every session as a run.
fn by_session(datasets: Vec<(String, Dataset)>) -> Vec<(String, Dataset)> {
    let [(_, only)] = &datasets[..] else { return datasets };
    let mut sessions: Vec<&str> = Vec::new();
    for session in only.samples.iter().filter_map(|s| s.session.as_deref()) {
        if !sessions.contains(&session) {
            sessions.push(session);
        }
    }
    if sessions.len() < 2 {
        return datasets;
    }
    let of = |session: &&str| {
        let mut own = only.clone();
        own.samples.retain(|s| s.session.as_deref() == Some(*session));
        ((*session).to_owned(), own)
    };
    sessions.iter().map(of).collect()
}

/// The date of every run.
fn dates(arguments: &Arguments, datasets: &[(String, Dataset)]) -> Result<Vec<Option<Date>>, Failure> {
    if !arguments.dates.is_empty() {
        if arguments.dates.len() != datasets.len() {
            let (dates, runs) = (arguments.dates.len(), datasets.len());
            return Err(format!("--dates names {dates} dates, and there are {runs} runs; give one for each").into());
        }
        return Ok(arguments.dates.iter().copied().map(Some).collect());
    }
    let stated = |(k, (_, dataset)): (usize, &(String, Dataset))| -> Result<Option<Date>, Failure> {
        let Some(value) = dataset.provenance.get("date") else { return Ok(None) };
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let day = text.get(..10).and_then(|day| day.parse().ok());
        day.map(Some).ok_or_else(|| {
            let folder = arguments.datasets.get(k).or(arguments.datasets.first()).cloned().unwrap_or_default();
            let problem = format!("'{text}' is not a date; write it as \"2026-03-14\"");
            Box::new(LocatedError { path: folder.join("dataset.toml"), field: "provenance.date", problem }) as Failure
        })
    };
    datasets.iter().enumerate().map(stated).collect()
}

/// The declared drifts, SI a month.
fn drifts(declared: &[String], datasets: &[(String, Dataset)], model: &Model) -> Result<Vec<(String, f64)>, Failure> {
    if declared.is_empty() {
        return Ok(Vec::new());
    }
    let named: Vec<NamedDataset<'_>> = datasets.iter().map(|(n, d)| NamedDataset::new(n.as_str(), d)).collect();
    let problem = Problem::new(&named, model, Use::Fit)?;
    let drift = |text: &String| -> Result<(String, f64), Failure> {
        let (name, size) = text.split_once('=').ok_or_else(|| format!("--drift {text}: write it as theta2=0.01"))?;
        let size: f64 = size
            .parse()
            .ok()
            .filter(|s: &f64| s.is_finite() && *s > 0.0)
            .ok_or_else(|| format!("--drift {text}: '{size}' is not a positive number"))?;
        let parameter = problem.parameters().iter().find(|p| p.name == name);
        let unit = parameter.ok_or_else(|| format!("--drift {text}: the model has no parameter '{name}'"))?.spec.unit;
        Ok((name.to_owned(), size * unit.si))
    };
    declared.iter().map(drift).collect()
}

fn located(arguments: &Arguments, datasets: &[(String, Dataset)], error: RunsError) -> Failure {
    let folder = |name: &str| {
        let own = arguments.datasets.iter().find(|f| f.ends_with(name));
        own.or(arguments.datasets.first()).cloned().unwrap_or_default()
    };
    match error {
        RunsError::Identify(e) => Box::new(locate_in_data(&arguments.datasets, datasets, arguments.model.as_deref(), &e)),
        RunsError::SameRows { ref run, .. } => Box::new(LocatedError {
            path: folder(run).join("samples.csv"),
            field: "rows",
            problem: format!("{}; leave it out", with_reasons(&error)),
        }),
        RunsError::FewRows { ref run, .. } => {
            Box::new(LocatedError { path: folder(run).join("samples.csv"), field: "rows", problem: with_reasons(&error) })
        }
        RunsError::NoDates => {
            "--drift needs the date of every run; give --dates, or `date` in [provenance] of each dataset".into()
        }
        other => with_reasons(&other).into(),
    }
}
