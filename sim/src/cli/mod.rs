//! The command line: one file a verb. Exit codes: 0 done, 1 an expectation failed, 2 bad input, 3 the cell or the disk.

mod add;
mod catalogue;
mod cell;
mod compare;
mod compensate;
mod data_gate;
mod design;
mod design_tables;
mod diagnose;
mod hidden_table;
mod identify;
mod import;
mod ladder;
mod measure;
mod measure_cell;
mod merge;
mod next;
mod operator;
mod plan;
mod plan_cell;
mod precision;
mod precision_tables;
mod progress;
mod prove;
mod rehearsal;
mod repeatability;
mod repeatability_cell;
mod repeatability_tables;
mod report;
mod run;
mod serve;
mod start;
mod study;
mod study_tables;
mod suite;
mod suite_tables;
mod validate;
mod workbench;

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use calibench::assess::{Examination, Extrapolation, WorkspaceError, WorkspacePoses, undetermined};
use calibench::effects::Subject;
use calibench::files::{FileError, FileFault, check_output_file, one_line};
use calibench::identify::{Calibration, IdentifyError, Model, ProblemError, read_calibration, read_model};
use calibench::measure::{Dataset, SampleSet, read_dataset};
use calibench::report::{Outlook, Recommended, extrapolation_sentence, no_outlook_sentence};
use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

use self::data_gate::{DoNotFit, gate};
use crate::blame::with_reasons;

/// Anything that ends a verb; printed with the chain of its reasons.
type Failure = Box<dyn std::error::Error>;

/// How a verb that came to its end went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Done,
    ExpectationFailed,
}

/// A simulation-first testbench for calibrating industrial robots.
#[derive(Parser)]
#[command(name = "calibench", version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// The whole procedure on a simulated cell: plan, master, probe, identify, validate; checks what the scenario expects
    Run(run::Arguments),
    /// Choose the poses to probe, by observability
    Plan(plan::Arguments),
    /// Probe the balls, of a simulated cell or a real one, and write a dataset
    Measure(measure::Arguments),
    /// A real cell: speak to its devices, or write the program for its robot
    Cell(cell::Arguments),
    /// Find the robot's parameters from datasets
    Identify(identify::Arguments),
    /// Judge a calibration on poses that it has not seen
    Validate(validate::Arguments),
    /// Find which effect is missing in the model
    Diagnose(diagnose::Arguments),
    /// Add one effect to the model, refit, and judge the step
    Add(add::Arguments),
    /// Diagnose, add, refit, until nothing is left or nothing helps
    Ladder(ladder::Arguments),
    /// Which extra measurements would tell the rivals apart, or lower the predicted error most
    Next(next::Arguments),
    /// The whole procedure again and again, every error drawn anew: how its results spread, at one point or along a sweep
    Study(study::Arguments),
    /// Where the balls of an artifact should stand: the smallest worst-case uncertainty over the workspace, against size and weight
    Design(design::Arguments),
    /// Put the shards of a study together, and tell what they say
    Merge(merge::Arguments),
    /// How far a centred ball stands from where the master ball stood (paper Table 3), and what that is made of
    Precision(precision::Arguments),
    /// What the robot repeats (RP after ISO 9283) and what each joint loses on reversal, measured with the gauge
    Repeatability(repeatability::Arguments),
    /// Does the advice hold? Measured campaigns are divided, and what one part recommends is judged on the other
    Prove(prove::Arguments),
    /// Blind trials of the diagnosis, held against the truth
    Suite(suite::Arguments),
    /// Where a calibration fails: noise floor, lack of fit, residuals by ball, tool, base and joint
    Compare(compare::Arguments),
    /// Use a calibration: the targets to tell the controller so that the tool stands where it is wanted; KRL, URDF, MDH
    Compensate(compensate::Arguments),
    /// One HTML page: what is wrong in words, then in pictures
    Report(report::Arguments),
    /// The simulated cell on the wires of a real one: three indicators and a robot that any program can talk to
    Serve(serve::Arguments),
    /// The same page live, on the loopback address: add effects, undo, write one's own, save
    Workbench(workbench::Arguments),
    /// Turn other people's data into a dataset
    Import(import::Arguments),
    /// The catalogue of what can be wrong with an arm
    Effects(catalogue::Arguments),
    /// The built-in robots
    Robots(catalogue::Arguments),
}

/// Runs the program with the arguments that it was started with.
pub fn main() -> ExitCode {
    main_with(std::env::args_os())
}

/// Runs the program with these arguments, of which the first is its name.
pub fn main_with(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(e) => {
            // Help and version are not mistakes.
            if !e.use_stderr() || e.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
                drop(e.print());
                return ExitCode::from(if e.use_stderr() { BAD_INPUT } else { 0 });
            }
            return refuse(&misuse(&e), BAD_INPUT);
        }
    };
    let result = match &arguments.verb {
        Verb::Run(a) => run::run(a),
        Verb::Plan(a) => plan::run(a),
        Verb::Measure(a) => measure::run(a),
        Verb::Cell(a) => cell::run(a),
        Verb::Identify(a) => identify::run(a),
        Verb::Validate(a) => validate::run(a),
        Verb::Diagnose(a) => diagnose::run(a),
        Verb::Add(a) => add::run(a),
        Verb::Ladder(a) => ladder::run(a),
        Verb::Next(a) => next::run(a),
        Verb::Study(a) => study::run(a),
        Verb::Design(a) => design::run(a),
        Verb::Merge(a) => merge::run(a),
        Verb::Precision(a) => precision::run(a),
        Verb::Repeatability(a) => repeatability::run(a),
        Verb::Prove(a) => prove::run(a),
        Verb::Suite(a) => suite::run(a),
        Verb::Compare(a) => compare::run(a),
        Verb::Compensate(a) => compensate::run(a),
        Verb::Report(a) => report::run(a),
        Verb::Serve(a) => serve::run(a),
        Verb::Workbench(a) => workbench::run(a),
        Verb::Import(a) => import::run(a),
        Verb::Effects(a) => catalogue::effects(a),
        Verb::Robots(a) => catalogue::robots(a),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::ExpectationFailed) => ExitCode::from(1),
        Err(failure) => {
            if is_closed_pipe(failure.as_ref()) {
                return ExitCode::SUCCESS;
            }
            let inconsistent = matches!(failure.downcast_ref(), Some(IdentifyError::Inconsistent { .. }));
            let code = match () {
                () if failure.is::<Interrupted>() || failure.is::<Hardware>() || is_of_disk(failure.as_ref()) => HARDWARE,
                () if inconsistent => 1,
                () => BAD_INPUT,
            };
            refuse(&with_reasons(failure.as_ref()), code)
        }
    }
}

/// Exit code: what was given cannot be used.
const BAD_INPUT: u8 = 2;
/// Exit code: the cell or the disk failed on the way.
const HARDWARE: u8 = 3;

/// One line on standard error, and that exit code.
fn refuse(message: &str, code: u8) -> ExitCode {
    drop(writeln!(std::io::stderr(), "calibench: {}", one_line(message)));
    ExitCode::from(code)
}

/// A device of the cell does not do what it should.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Hardware(String);

/// A campaign was cut short by its cell or by the disk; what it measured is in its journal.
#[derive(Debug, thiserror::Error)]
#[error("{why}; {kept} probings are kept in {}: go on with `--resume`", journal.display())]
struct Interrupted {
    why: String,
    kept: usize,
    journal: PathBuf,
}

/// What is wrong with a command line, in one line.
fn misuse(error: &clap::Error) -> String {
    let text = error.render().to_string();
    // The paragraphs after the first show the usage, which --help does better; tips and lists of values stay.
    let told = text.lines().map(str::trim).take_while(|l| !l.starts_with("Usage:") && !l.starts_with("For more information"));
    let told: Vec<&str> = told.filter(|l| !l.is_empty()).collect();
    format!("{}; `calibench --help` and `calibench VERB --help` tell more", told.join(" ").trim_start_matches("error: "))
}

/// Parses a seed.
fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("give a whole number from 0 to {}", u64::MAX))
}

/// That a file or a folder is to blame for an error which does not know it.
#[derive(Debug, thiserror::Error)]
#[error("{}: {field}: {problem}", path.display())]
struct Blamed {
    path: PathBuf,
    field: &'static str,
    problem: String,
}

/// Puts the failure of an identification at the data or at the model.
fn blame_data(folders: &[PathBuf], datasets: &[(String, Dataset)], model: Option<&Path>, error: &IdentifyError) -> Blamed {
    let at = |k: usize, file: &str| folders.get(k).map(|f| f.join(file)).unwrap_or_default();
    let of_robot = |name: &str| datasets.iter().position(|(_, d)| d.robot.name == name).unwrap_or(0);
    let (path, field) = match (error, model) {
        (
            IdentifyError::OtherRobot { measured: other, .. }
            | IdentifyError::Problem(ProblemError::DifferentRobots { other, .. }),
            _,
        ) => (at(of_robot(other), "dataset.toml"), "robot"),
        (IdentifyError::Problem(ProblemError::Effect(_) | ProblemError::Missing { .. }), Some(model)) => {
            (model.to_owned(), "effects")
        }
        (IdentifyError::Problem(ProblemError::NoSamples { .. }), _) => (at(0, "samples.csv"), "set"),
        _ => (at(0, "samples.csv"), "rows"),
    };
    Blamed { path, field, problem: with_reasons(error) }
}

/// A disk that is full or fails, among the reasons.
fn is_of_disk(failure: &(dyn std::error::Error + 'static)) -> bool {
    let mut reasons = std::iter::successors(Some(failure), |reason| reason.source());
    reasons.any(|reason| reason.downcast_ref::<FileError>().is_some_and(|e| e.fault == FileFault::Disk))
}

/// That every file that is asked for can be written, before the work that makes it.
fn check_outputs<'a>(files: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), FileError> {
    files.into_iter().try_for_each(|file| check_output_file(file))
}

/// Whoever read the output has seen enough.
fn is_closed_pipe(failure: &(dyn std::error::Error + 'static)) -> bool {
    failure.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
}

/// Prints text to standard output; a closed pipe is an error, not a panic.
fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.write_all(b"\n")?;
    Ok(())
}

/// Prints one JSON document.
fn print_json(value: &serde_json::Value) -> Result<(), Failure> {
    print(&serde_json::to_string_pretty(value)?)
}

/// Datasets with the names of their folders: the last part of the path, or as much of its end as tells them apart.
fn read_datasets(folders: &[PathBuf]) -> Result<Vec<(String, Dataset)>, Failure> {
    // `.` and `D/` are named like the folders they are.
    let whole: Vec<PathBuf> = folders.iter().map(|f| f.canonicalize().unwrap_or_else(|_| f.clone())).collect();
    let parts = |folder: &Path| folder.iter().map(|part| part.to_string_lossy().into_owned()).collect::<Vec<String>>();
    let end = |folder: &Path, length: usize| {
        let parts = parts(folder);
        parts[parts.len().saturating_sub(length)..].join("/")
    };
    let distinct = |length: &usize| {
        let names: Vec<String> = whole.iter().map(|f| end(f, *length)).collect();
        (1..names.len()).all(|k| whole[..k].contains(&whole[k]) || !names[..k].contains(&names[k]))
    };
    let longest = whole.iter().map(|f| f.iter().count()).max().unwrap_or(1);
    let length = (1..=longest).find(distinct).unwrap_or(longest);
    let mut datasets: Vec<(String, Dataset)> = Vec::with_capacity(folders.len());
    for (folder, whole) in folders.iter().zip(&whole) {
        let dataset = read_dataset(folder)?;
        // A copy would count twice what was measured once.
        if let Some((first, _)) = datasets.iter().find(|(_, d)| d.hash == dataset.hash) {
            eprintln!("{} holds the same data as {first}; they are counted once.", folder.display());
            continue;
        }
        datasets.push((end(whole, length), dataset));
    }
    Ok(datasets)
}

/// The model of that file, or the one that the data get when none is named.
fn model_for(path: Option<&Path>, datasets: &[(String, Dataset)]) -> Result<Model, Failure> {
    let first = &datasets[0].1;
    Ok(match path {
        Some(path) => read_model(path, &Subject::new(&first.robot, &first.ball_ids()))?,
        None => Model::default_for(first),
    })
}

/// Campaigns that are not fitted but judged, of the same arm as the data; what is fitted as well is none.
fn check_datasets(folders: &[PathBuf], fitted: &[(String, Dataset)]) -> Result<Vec<(String, Dataset)>, Failure> {
    let mut checks = read_datasets(folders)?;
    let first = &fitted[0].1;
    if let Some((name, other)) = checks.iter().find(|(_, d)| !d.robot.is_same_arm(&first.robot)) {
        let problem = format!(
            "is of '{}', the data are of '{}'; check against campaigns of the same robot",
            other.robot.name, first.robot.name
        );
        let folder = folders.iter().find(|f| f.ends_with(name)).unwrap_or(&folders[0]);
        return Err(Box::new(Blamed { path: folder.join("dataset.toml"), field: "robot", problem }));
    }
    checks.retain(|(name, check)| {
        // Rows of set `validation` are judged, and not fitted.
        let is_fitted =
            check.samples.iter().all(|s| s.set == SampleSet::Fit) && fitted.iter().any(|(_, d)| d.hash == check.hash);
        if is_fitted {
            eprintln!("{name} is among the data that are fitted; it is no check, and is left out of them.");
        }
        !is_fitted
    });
    Ok(checks)
}

/// The error to expect of an examined fit at `poses`, or why it cannot be told.
fn outlook(
    named: &[(&str, &Dataset)],
    examination: &Examination,
    poses: &WorkspacePoses,
) -> Result<Result<Outlook, String>, IdentifyError> {
    let Some(error) = WorkspaceError::predict(named, examination, &poses.q)? else {
        return Ok(Err(no_outlook_sentence(&undetermined(examination))));
    };
    let ranges = examination.problem().joint_ranges();
    let extrapolation = Extrapolation::of(&ranges, examination.model(), poses.q.iter().map(Vec::as_slice));
    Ok(Ok(Outlook { error, source: poses.source, extrapolation }))
}

/// Reads a calibration; says on standard error where its fit did not converge.
fn read_calibration_to_use(path: &Path) -> Result<Calibration, Failure> {
    let calibration = read_calibration(path)?;
    if let Some(outcome) = calibration.unconverged() {
        eprintln!("warning: {}: the fit {}: do not use this calibration", path.display(), outcome.in_words());
    }
    Ok(calibration)
}

/// Says on standard error how far the poses of a prediction reach beyond what a calibration has seen.
fn warn_of_poses(calibration: &Calibration, poses: &WorkspacePoses) {
    let beyond = Extrapolation::of(&calibration.joint_ranges, &calibration.model, poses.q.iter().map(Vec::as_slice));
    if let Some(warning) = extrapolation_sentence(&beyond) {
        eprintln!("{warning}");
    }
}

/// How recommended commands go on after the verb.
fn recommended(folders: &[PathBuf], model: Option<&Path>) -> Recommended {
    let quoted = |path: &Path| {
        let text = path.display().to_string();
        let plain = text.chars().all(|c| c.is_ascii_alphanumeric() || "/._-+:".contains(c));
        if plain { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
    };
    Recommended {
        datasets: folders.iter().map(|f| quoted(f)).collect::<Vec<_>>().join(" "),
        model: model.map_or(String::new(), |m| format!(" --model {}", quoted(m))),
    }
}

/// Borrowed, as the library takes them.
fn named(datasets: &[(String, Dataset)]) -> Vec<(&str, &Dataset)> {
    datasets.iter().map(|(n, d)| (n.as_str(), d)).collect()
}
