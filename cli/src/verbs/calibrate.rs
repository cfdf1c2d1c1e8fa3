//! `calibrate TABLE... --robot ROBOT -o FOLDER`: from a table of joints and positions to a calibration, judged on poses held out.

use std::convert::Infallible;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use calibench::compensate::urdf::urdf;
use calibench::compensate::{Compensator, Task};
use calibench::files::FileError;
use calibench::files::disk::{check_output_folder, write_whole};
use calibench::files::streams::is_standard_input;
use calibench::identify::Model;
use calibench::identify::calibration::{Calibration, IdentifyError, write_calibration};
use calibench::identify::fit::FitError;
use calibench::identify::model_file::write_model;
use calibench::identify::problem::Use;
use calibench::import::{Guess, Holdout, HoldoutChoice, ImportOptions, guess, state_noise, without_noise};
use calibench::judgement::Judgement;
use calibench::measure::campaign::journal::refuse_measured;
use calibench::measure::dataset::Dataset;
use calibench::measure::dataset::file::{read_dataset, write_dataset, write_dataset_with};
use calibench::measure::dataset::{NamedDataset, SampleSet};
use calibench::prediction::WorkspacePoses;
use calibench::robot::BUILT_IN;
use calibench::robot::robot_file::{RobotReference, robot};
use calibench::robot::urdf::calibrated_urdf;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{Ladder, LadderProgress, observed_ladder};
use calibench_logs::{LogTable, MOMENTS, STILLS, is_log};
use calibench_report::documents::{self, to_value};
use calibench_report::{Recommended, all_called, first_screen, nominal_fit_line, what_to_do_now};

use crate::arguments::data::{MODEL, from_anywhere};
use crate::arguments::data_gate::gate;
use crate::arguments::logs::{self, LogArguments};
use crate::arguments::quantities::{duration, length};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print, print_answer, print_detail, print_json};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::input;

/// Files of a calibrated folder beside those of a dataset.
const FILES: &[&str] =
    &[JUDGEMENT, "robot.toml", CALIBRATION, CALIBRATED_ROBOT, MODEL, URDF, super::report::FILE, MAP, STILLS, MOMENTS];
/// The judgement as a document.
const JUDGEMENT: &str = "judgement.json";
const CALIBRATION: &str = "calibration.toml";
/// Beside it, a robot that is not built in.
const CALIBRATED_ROBOT: &str = "calibration.robot.toml";
const URDF: &str = "calibrated.urdf";
/// The column map by which the tables were read.
const MAP: &str = "map.toml";

/// Share of the postures that is held out.
const HELD_OUT: f64 = 0.2;
/// Fewest rows of which some can be fitted and the others judge.
const FEWEST: usize = 10;
/// Seed of the choice of what is held out.
const SEED: u64 = 1;

#[derive(clap::Args)]
pub struct Arguments {
    /// Tables of joint angles and measured positions, all of one kind; or a recording over time (MCAP, ROS 2 bag); or one dataset
    /// folder
    #[arg(required = true, value_name = "TABLE|DATASET", value_parser = input())]
    tables: Vec<PathBuf>,
    /// The measured robot: built-in, a robot file or a URDF. A dataset names its own
    #[arg(long, value_name = "ROBOT")]
    robot: Option<String>,
    /// One-sigma of the instrument for each coordinate, such as 20um or 0.02mm; if it is not given, it is found from the residuals
    #[arg(long, value_parser = length)]
    noise: Option<f64>,
    /// Time from one row to the next, such as 30s, if the rows stand in the order of measurement: what was bumped, loosened or warmed up
    /// on the way is then found
    #[arg(long, value_name = "TIME", value_parser = duration)]
    every: Option<f64>,
    /// Largest position error that the robot may have, such as 0.2mm: the exit code is 1 if a pose held out has a larger one
    #[arg(long, value_parser = length)]
    tolerance: Option<f64>,
    /// Output folder: calibration.toml, model.toml, report.html, calibrated.urdf, judgement.json, the dataset and its map; an existing one is replaced
    #[arg(short, long, visible_alias = "out")]
    output: PathBuf,
    #[command(flatten)]
    log: LogArguments,
    /// Continue with data that do not fit the robot; every result says so
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of text
    #[arg(long)]
    json: bool,
}

/// What was read.
struct Source {
    dataset: Dataset,
    /// The map by which tables were read.
    map: Option<Guess>,
    /// What was understood, in lines.
    said: Vec<String>,
    /// The table of a log: its file, and its text.
    of_log: Option<LogRows>,
}

/// The table of a log.
struct LogRows {
    file: &'static str,
    text: String,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let folder = &arguments.output;
    check_output_folder(folder, "calibration", JUDGEMENT)?;
    refuse_measured(folder)?;
    let waiting = Waiting::new("reading");
    let Source { mut dataset, map, said, of_log } = read(arguments)?;
    if let Some(noise) = arguments.noise {
        state_noise(&mut dataset, noise);
    }
    if !dataset.samples.iter().any(|s| s.set == SampleSet::Validation) {
        Holdout { fraction: HELD_OUT, seed: SEED, choice: HoldoutChoice::Blocks }.apply(&mut dataset);
    }
    if dataset.samples.len() < FEWEST {
        let (rows, file) = (dataset.samples.len(), arguments.tables[0].display());
        return Err(format!("{file}: has only {rows} rows; give at least {FEWEST}: some are fitted, the others judge").into());
    }
    waiting.begin("comparing with the nominal arm");
    let datasets = [(String::new(), as_written(&dataset)?)];
    let gate = gate(&datasets, Use::All, arguments.force, arguments.json)?;
    let [(_, dataset)] = datasets;
    let name = name_of(folder);
    waiting.begin("calibrating");
    let located = |error| located(&arguments.tables[0], error);
    let ladder = |dataset: &Dataset| {
        run_ladder(&waiting, &[NamedDataset::new(&name, dataset)], &Model::default_for(dataset)).map_err(located)
    };
    let first = ladder(&dataset)?;
    // What is far below the residual binds a fit into a valley that has no end.
    let is_lost = first.first().calibration.unconverged().is_some();
    let freed = without_noise(&dataset).filter(|_| is_lost).map(|freed| as_written(&freed)).transpose()?;
    let again = freed.map(|freed| ladder(&freed).map(|ladder| (freed, ladder))).transpose()?;
    let again = again.filter(|(_, ladder)| ladder.first().calibration.unconverged().is_none());
    let is_freed = again.is_some();
    let (dataset, ladder) = again.unwrap_or((dataset, first));
    let named = [NamedDataset::new(&name, &dataset)];
    waiting.begin("judging");
    let mut judgement = Judgement::of(&named, &named, &ladder).map_err(located)?;
    if gate.misfit.is_some() {
        judgement.doubt();
    }
    let chosen = ladder.recommended();
    let calibration = Calibration { misfit: gate.misfit.clone(), ..chosen.calibration.clone() };
    let is_met = arguments.tolerance.is_none_or(|tolerance| judgement.errors.last().is_some_and(|v| v.max <= tolerance));
    let outcome = if is_met && !judgement.errors.does_harm() { Outcome::Done } else { Outcome::ExpectationFailed };
    let commands = Recommended::of(std::slice::from_ref(folder), Some(&folder.join(MODEL)));
    let mut to_do = what_to_do_now(
        &judgement,
        chosen.calibration.noise_stated || is_freed,
        &folder.join(CALIBRATION).display().to_string(),
        &commands,
    );
    if is_freed {
        to_do.push("look for what moved or slipped: no fit converges under the stated noise, which is ignored".into());
    }
    let document = documents::Judged {
        next: to_do.clone(),
        misfit: gate.misfit.clone(),
        ..documents::Judged::of(&judgement, arguments.tolerance)
    };
    waiting.begin("writing");
    // Several set-ups, or links that a URDF cannot hold: the other files are worth having.
    let urdf = urdf_of(&calibration, arguments.robot.as_deref());
    if let Err(why) = &urdf {
        waiting.warn(&format!("warning: no {URDF} is written: {why}"));
    }
    write_dataset_with(&dataset, folder, FILES, |inside| {
        write_calibration(&calibration, &inside.join(CALIBRATION))?;
        write_model(&chosen.model, &inside.join(MODEL))?;
        if let Some(guess) = &map {
            let map = if dataset.noise.point.is_some() { guess.map_with(&dataset.noise) } else { guess.map.clone() };
            write_whole(&inside.join(MAP), map.as_bytes())?;
        }
        if let Some(LogRows { file, text }) = &of_log {
            write_whole(&inside.join(file), text.as_bytes())?;
        }
        if let Ok(urdf) = &urdf {
            write_whole(&inside.join(URDF), urdf.as_bytes())?;
        }
        write_whole(&inside.join(JUDGEMENT), format!("{:#}\n", to_value(&document)).as_bytes())
    })?;
    waiting.begin("writing the report");
    super::report::write_report(folder, &folder.join(MODEL), &document)?;
    drop(waiting);
    if arguments.json {
        print_json(&document)?;
        return Ok(outcome);
    }
    said.iter().try_for_each(|line| print(line))?;
    let larger = gate.fits.iter().filter(|fit| fit.nominal.left_out.is_some());
    larger.map(|fit| nominal_fit_line(&fit.nominal)).try_for_each(print_answer)?;
    gate.misfit.iter().try_for_each(|sentence| print_answer(sentence))?;
    print_answer(first_screen(&name, &named, &judgement, arguments.tolerance))?;
    to_do.iter().try_for_each(|line| print_answer(format!("Next: {line}.")))?;
    let links = if urdf.is_ok() { format!("{URDF}, ") } else { String::new() };
    print_answer(format!("Written to {}: {CALIBRATION}, {MODEL}, {links}report.html", folder.display()))?;
    Ok(outcome)
}

/// The table of rows that cannot be fitted, and what it lacks.
fn located(table: &Path, error: IdentifyError) -> Failure {
    let problem = match &error {
        IdentifyError::Fit(FitError::TooFewRows { unknowns, .. }) => {
            let rows = 1.0 + *unknowns as f64 / 3.0 / (1.0 - HELD_OUT);
            format!(
                "too few rows for the {unknowns} unknowns of this arm, and a fifth of them is held out; give at least {rows:.0}, and three times as many to know it well"
            )
        }
        _ => error.to_string(),
    };
    format!("{}: {problem}", table.display()).into()
}

/// The name of the data: that of the folder.
fn name_of(folder: &Path) -> String {
    folder.file_name().map_or_else(|| "data".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Reads a dataset folder, or tables through a map that is guessed from the first.
fn read(arguments: &Arguments) -> Result<Source, Failure> {
    // Tables over time are taken for recordings where that is asked for.
    if arguments.log.moving || arguments.tables.iter().any(|table| is_log(table)) {
        return read_log(arguments);
    }
    if let Some(flag) = arguments.log.given() {
        return Err(format!("{flag} is for recordings over time: .mcap, .db3, or the folder of a bag").into());
    }
    if let [folder] = arguments.tables.as_slice()
        && folder.is_dir()
    {
        if arguments.robot.is_some() {
            return Err("--robot is for tables: a dataset names its robot itself".into());
        }
        let mut dataset = read_dataset(folder)?;
        if let Some(time) = arguments.every {
            if dataset.samples.iter().any(|s| s.time_s.is_some()) {
                return Err("--every is for rows without times: the samples of this dataset have them (time_s)".into());
            }
            dataset.state_times(time);
        }
        return Ok(Source { dataset, map: None, said: Vec::new(), of_log: None });
    }
    let named = named_robot(arguments)?;
    let guessed = guess(&arguments.tables[0], &robot(named, Path::new(""))?, &from_anywhere(named))?;
    let guessed = if let Some(time) = arguments.every { guessed.every(time) } else { guessed };
    let (dataset, report) = guessed.import(&arguments.tables, &ImportOptions::default())?;
    let skipped = report.skipped.first().map(|first| {
        let of_them = if report.skipped.len() == 1 { "" } else { "the first of them " };
        format!(", {} skipped ({of_them}line {}: {})", report.skipped.len(), first.line, first.reason)
    });
    let rows = format!("Read: {} rows{}", dataset.samples.len(), skipped.unwrap_or_default());
    let said = |about: &str| guessed.reasons.iter().find(|reason| reason.starts_with(about)).cloned();
    let understood =
        [Some(rows), said("joints: "), said("positions: "), said("orientations: "), said("an orientation"), said("left out")];
    let understood: Vec<String> = understood.into_iter().flatten().collect();
    print_detail(report.to_string());
    guessed.reasons.iter().for_each(print_detail);
    Ok(Source { dataset, said: vec![understood.join("; ") + "."], map: Some(guessed), of_log: None })
}

/// The robot that was named for tables and logs.
fn named_robot(arguments: &Arguments) -> Result<&str, Failure> {
    if let Some(named) = arguments.robot.as_deref() {
        return Ok(named);
    }
    // A folder that is not there is a dataset with a robot of its own, perhaps.
    let is_there = |table: &PathBuf| is_standard_input(table) || table.exists();
    if let Some(missing) = arguments.tables.iter().find(|table| !is_there(table)) {
        return Err(FileError::whole(missing, "is not there", "give a table, or the folder of a dataset").into());
    }
    let problem =
        format!("--robot is missing: which robot was measured? One of {}, a robot file or a URDF", BUILT_IN.join(", "));
    Err(problem.into())
}

/// Reads the still poses of recordings.
fn read_log(arguments: &Arguments) -> Result<Source, Failure> {
    if arguments.every.is_some() {
        return Err("--every is for rows without times: a recording has them".into());
    }
    let named = named_robot(arguments)?;
    let workplace = tempfile::tempdir()?;
    let LogTable { text, file, guess, said, excluded, .. } =
        logs::table(&arguments.tables, named, &arguments.log, arguments.noise, workplace.path())?;
    let (dataset, report) = guess.import(&[workplace.path().join(file)], &ImportOptions::default())?;
    excluded.iter().for_each(|e| print_detail(format!("{:.2} to {:.2} s: {}", e.from_s, e.to_s, e.why)));
    print_detail(report.to_string());
    guess.reasons.iter().for_each(print_detail);
    Ok(Source { dataset, said, map: Some(guess), of_log: Some(LogRows { file, text }) })
}

/// The dataset as it is read back, with the digest by which a calibration knows it and with a robot of its own.
fn as_written(dataset: &Dataset) -> Result<Dataset, Failure> {
    let folder = tempfile::tempdir()?;
    write_dataset(dataset, folder.path())?;
    Ok(read_dataset(folder.path())?)
}

/// The ladder, its progress told in the spinner.
fn run_ladder(waiting: &Waiting, named: &[NamedDataset<'_>], model: &Model) -> Result<Ladder, IdentifyError> {
    let poses = WorkspacePoses::of(named);
    let ground = HoldOut { poses: &poses, checks: &[], worker: None };
    let mut steps = 0;
    let ladder = observed_ladder(named, model, ground, &mut |progress| {
        match progress {
            LadderProgress::Trying(effects) => {
                waiting.now(format!("step {steps}: trying {}", all_called(&model.registry, effects)));
            }
            LadderProgress::Reached(_) => steps += 1,
            LadderProgress::Choosing => waiting.now("comparing the steps with a model of all errors at once"),
            LadderProgress::Refused(_) => {}
        }
        ControlFlow::<Infallible>::Continue(())
    });
    let ControlFlow::Continue(ladder) = ladder?;
    Ok(ladder)
}

/// The calibrated links as a URDF: the given one with new origins, if the robot was one.
fn urdf_of(calibration: &Calibration, given: Option<&str>) -> Result<String, Failure> {
    let rigid = Compensator::new(calibration, &Task::default())?.rigid();
    let reference = given.map(RobotReference::parse);
    match reference.filter(|r| !BUILT_IN.contains(&r.name) && r.name.ends_with(".urdf")) {
        Some(RobotReference { name, ends }) => Ok(calibrated_urdf(Path::new(name), &ends, &calibration.robot, &rigid.robot)?),
        None => Ok(urdf(&rigid)),
    }
}
