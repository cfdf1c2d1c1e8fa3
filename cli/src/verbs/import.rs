//! `import FORMAT FILE... -o DATASET`.

mod log;

use std::path::{Path, PathBuf};

use calibench::files::disk::{check_output_file, check_output_folder, write_whole};
use calibench::files::streams::is_standard_output;
use calibench::identify::problem::Use;
use calibench::import::{Holdout, HoldoutChoice, ImportOptions, guess, import};
use calibench::measure::campaign::journal::refuse_measured;
use calibench::measure::dataset::file::{DATASET_TOML, write_dataset};
use calibench::measure::dataset::{NamedDataset, SampleSet};
use calibench::residuals::misfit::data_fit;
use calibench::robot::robot_file::robot;
use calibench::units::MM;
use calibench_report::{documents, misfit_sentence};
use serde_json::json;

use crate::arguments::choices::seed;
use crate::arguments::data::from_anywhere;
use crate::arguments::data_gate::gate;
use crate::arguments::logs::LogArguments;
use crate::arguments::quantities::length;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{note, print, print_answer, print_json};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::{input, output};

#[derive(clap::Args)]
pub struct Arguments {
    /// Format of the files: ur10-ipa, ur5-jacobi, mukca, or generic; log, for recordings over time; or guess, which proposes a column
    /// map for generic
    format: String,
    /// Files to read (for mukca folders as well)
    #[arg(required = true, value_parser = input())]
    files: Vec<PathBuf>,
    /// Output folder for the dataset; an existing dataset is replaced, but for one that `measure` made. For guess the output file for the map
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: PathBuf,
    /// A file, or with mukca also the folder of a place, to keep for validation; may be repeated, and may be one of FILE...
    #[arg(long, value_name = "FILE")]
    validation: Vec<PathBuf>,
    /// For generic: file that assigns a meaning to each column
    #[arg(long, value_parser = input())]
    map: Option<PathBuf>,
    /// For guess and log: the measured robot, built-in, a robot file or a URDF; for mukca, if it is not the Panda
    #[arg(long, value_name = "ROBOT")]
    robot: Option<PathBuf>,
    /// For mukca: distance between neighbouring sockets of a place, mm, if it is not 50
    #[arg(long, value_name = "MM", value_parser = distance)]
    distance: Option<f64>,
    /// A dataset measured on the same set-up: base, tool and targets are taken from it, not found from these rows, so that `keep check` can compare the two
    #[arg(long, value_name = "DATASET")]
    set_up_of: Option<PathBuf>,
    /// Fraction of the postures to keep for validation, chosen at random, each with all its rows
    #[arg(long, value_parser = fraction)]
    holdout: Option<f64>,
    /// Seed of the random choice
    #[arg(long, value_parser = seed, allow_negative_numbers = true, default_value_t = 1)]
    seed: u64,
    /// For log: one-sigma of the instrument for each coordinate, such as 20um; that of a row is this and the scatter of its mean
    #[arg(long, value_parser = length)]
    noise: Option<f64>,
    #[command(flatten)]
    log: LogArguments,
    /// Write the dataset even if its data do not fit the robot
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of text
    #[arg(long)]
    json: bool,
}

fn distance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(mm) if (1.0..=10_000.0).contains(&mm) => Ok(mm),
        _ => Err("give a length in mm, e.g. 40".into()),
    }
}

fn fraction(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (0.0..1.0).contains(&v) => Ok(v),
        _ => Err("give a share of at least 0 and below 1, e.g. 0.3".into()),
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if arguments.format == "guess" {
        if arguments.set_up_of.is_some() {
            return Err("--set-up-of: guess proposes a map and makes no dataset; give it to the import with that map".into());
        }
        return propose_map(arguments);
    }
    let only_log = arguments.log.given().or(arguments.noise.map(|_| "--noise"));
    if let Some(flag) = only_log.filter(|_| arguments.format != "log") {
        return Err(format!("{flag} is for logs: import log FILE...").into());
    }
    if is_standard_output(&arguments.output) {
        return Err("output: a dataset is a folder, and cannot be standard output; name one with -o".into());
    }
    check_output_folder(&arguments.output, "dataset", DATASET_TOML)?;
    refuse_measured(&arguments.output)?;
    if arguments.format == "log" {
        return log::run(arguments);
    }
    let holdout = holdout(arguments);
    let (files, sets) = sets(arguments)?;
    let options = ImportOptions {
        holdout,
        map: arguments.map.clone(),
        robot: arguments.robot.clone(),
        sockets_apart: arguments.distance.map(|mm| mm * MM),
        set_up_of: arguments.set_up_of.clone(),
        sets,
    };
    let waiting = Waiting::new("reading");
    let (dataset, report) = import(&arguments.format, &files, &options)?;
    let datasets = [(String::new(), dataset)];
    let gate = gate(&datasets, Use::All, arguments.force, arguments.json)?;
    drop(waiting);
    let [(_, dataset)] = datasets;
    let folder = arguments.output.display().to_string();
    write_dataset(&dataset, &arguments.output)?;
    let kept = dataset.samples.iter().filter(|s| s.set == SampleSet::Validation).count();
    let all = dataset.samples.len();
    if arguments.json {
        let nominal_fit = gate.fits.first().map(|fit| documents::NominalFit::of(&fit.nominal));
        let document = documents::ImportReport::new(&report, folder);
        print_json(&documents::ImportReport { samples: all, validation: kept, nominal_fit, misfit: gate.misfit, ..document })?;
        return Ok(Outcome::Done);
    }
    print(report.to_string())?;
    gate.tell()?;
    print_answer(format!("{all} samples, {kept} of them for validation; dataset in {folder}"))?;
    Ok(Outcome::Done)
}

/// The share of the postures to be kept for validation.
fn holdout(arguments: &Arguments) -> Option<Holdout> {
    arguments.holdout.map(|fraction| Holdout { fraction, seed: arguments.seed, choice: HoldoutChoice::Postures })
}

/// Proposes a column map, says why, and shows the first rows as it understands them.
fn propose_map(arguments: &Arguments) -> Result<Outcome, Failure> {
    let [file] = arguments.files.as_slice() else {
        return Err("guess reads one file at a time; the map that it proposes serves all files of its kind".into());
    };
    let Some(named) = arguments.robot.as_ref().and_then(|r| r.to_str()) else {
        return Err("guess needs the robot; give --robot NAME, a robot file or a URDF".into());
    };
    check_output_file(&arguments.output)?;
    let robot = robot(named, Path::new(""))?;
    let waiting = Waiting::new("guessing");
    let found = guess(file, &robot, &from_anywhere(named))?;
    drop(waiting);
    write_whole(&arguments.output, found.map.as_bytes())?;
    // The map is tried as written, where it can be read again.
    let dataset = if arguments.output.is_file() {
        let options = ImportOptions { map: Some(arguments.output.clone()), ..ImportOptions::default() };
        import("generic", &arguments.files, &options)?.0
    } else {
        found.dataset
    };
    let misfit = data_fit(&[NamedDataset::new("", &dataset)], Use::All).into_iter().find_map(|fit| fit.misfit);
    let misfit = misfit.as_ref().map(misfit_sentence);
    let outcome = if misfit.is_some() { Outcome::ExpectationFailed } else { Outcome::Done };
    if arguments.json {
        print_json(
            &json!({"format": "calibench-import-guess/1", "map": found.map, "reasons": found.reasons, "rows": found.shown,
            "nominal_rms_mm": found.residual / MM, "misfit": misfit, "written": arguments.output}),
        )?;
        return Ok(outcome);
    }
    found.reasons.iter().try_for_each(|reason| print(reason))?;
    print("The first rows are understood as")?;
    found.shown.iter().try_for_each(|row| print(format!("  {row}")))?;
    let (file, map) = (file.display(), arguments.output.display());
    if let Some(misfit) = misfit {
        print_answer(misfit)?;
    }
    print_answer(format!("Check them, and the map in {map}; then `calibench import generic {file} --map {map} -o DATASET`."))?;
    Ok(outcome)
}

/// All files, those to be fitted first, with the set of each; no sets if the user leaves the choice to the format.
fn sets(arguments: &Arguments) -> Result<(Vec<PathBuf>, Vec<SampleSet>), Failure> {
    let same = |a: &PathBuf, b: &PathBuf| a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
    let mut named: Vec<PathBuf> = Vec::new();
    for file in &arguments.files {
        if named.iter().any(|n| same(n, file)) {
            note(&format!("{} is named twice; it is counted once.", file.display()));
        } else {
            named.push(file.clone());
        }
    }
    if arguments.validation.is_empty() {
        return Ok((named, Vec::new()));
    }
    let fitted = named.iter().filter(|f| !arguments.validation.iter().any(|v| same(v, f)));
    let mut files: Vec<PathBuf> = fitted.cloned().collect();
    if files.is_empty() {
        return Err("all files are kept for validation; leave at least one to be fitted".into());
    }
    let mut sets = vec![SampleSet::Fit; files.len()];
    files.extend(arguments.validation.iter().cloned());
    sets.resize(files.len(), SampleSet::Validation);
    Ok((files, sets))
}
