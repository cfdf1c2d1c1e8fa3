//! The command line: one file per verb and one per group of verbs. Exit codes: 0 done, 1 an expectation or consistency check failed, 2 bad input, 3 the
//! cell or the disk.

mod add;
mod bench;
mod calibrate;
mod catalogue;
mod cell;
mod check;
mod compare;
mod compensate;
mod design;
mod diagnose;
mod discover;
mod effects;
mod fleet;
mod gallery;
mod identify;
mod import;
mod keep;
mod ladder;
mod measure;
mod merge;
mod moved;
mod next;
mod overwritten;
mod plan;
mod precision;
mod prove;
mod recover;
mod repeatability;
mod report;
mod robots;
mod run;
mod runs;
mod serve;
mod shell;
mod sim;
mod study;
mod suite;
mod validate;
mod workbench;

use std::ffi::OsString;
use std::process::ExitCode;
use std::time::Instant;

use calibench::files::one_line;
use calibench::files::with_reasons;
use calibench::identify::calibration::IdentifyError;
use clap::error::ErrorKind;
use clap::{ArgAction, CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::terminal::failure::{
    BAD_INPUT, Failure, HARDWARE, Hardware, Interrupted, Outcome, hint, is_closed_pipe, is_of_disk,
};
use crate::terminal::fitting;
use crate::terminal::help;
use crate::terminal::output;
use crate::terminal::output::{Level, Manner, tell};
use crate::terminal::palette::When;
use crate::terminal::streams::Streams;

/// A simulation-first testbench for calibrating industrial robots.
#[derive(Parser)]
#[command(name = "calibench", version, arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    verb: Verb,
    /// Do not fit tables and sentences to the terminal (or to COLUMNS)
    #[arg(long, global = true)]
    wide: bool,
    /// Print the result alone; twice: without warnings
    #[arg(short, long, global = true, action = ArgAction::Count, conflicts_with = "verbose")]
    quiet: u8,
    /// Also print how the result came about: times, steps, files, rules
    #[arg(short, long, global = true, action = ArgAction::Count)]
    verbose: u8,
    /// When to use colour
    #[arg(long = "color", visible_alias = "colour", global = true, value_enum, value_name = "WHEN", default_value_t)]
    colour: When,
}

#[derive(Subcommand)]
enum Verb {
    /// Calibrate a robot from a table of joint angles and measured positions, judge it on poses held out, and write all results
    Calibrate(calibrate::Arguments),
    /// Convert third-party data into a dataset
    Import(import::Arguments),
    /// Identify the robot's parameters from datasets
    Identify(identify::Arguments),
    /// Judge a calibration on unseen poses
    Validate(validate::Arguments),
    /// Find the effect missing from the model
    Diagnose(diagnose::Arguments),
    /// Add one effect to the model, refit, and judge the step
    Add(add::Arguments),
    /// Search the residuals for a law that nobody listed: a product of functions of angles, loads, gravity, moves, time
    Discover(discover::Arguments),
    /// Diagnose, add and refit until only noise remains or nothing helps
    Ladder(ladder::Arguments),
    /// Locate the errors of a calibration: noise floor, lack of fit, residuals by ball, tool, base and joint
    Compare(compare::Arguments),
    /// Write one HTML page: the errors in words, then in pictures
    Report(report::Arguments),
    /// Serve the report's page live on the loopback address: add effects, undo, write user-defined ones, save
    Workbench(workbench::Arguments),
    /// Apply a calibration: the targets to command so that the tool reaches the desired pose; KRL, URDF, MDH
    Compensate(compensate::Arguments),
    /// Choose the poses to probe, by observability; `plan next`: those that would add most to datasets
    Plan(plan::Arguments),
    /// Probe the balls of a simulated or real cell, and write a dataset
    Measure(measure::Arguments),
    /// Simulation
    #[command(subcommand)]
    Sim(sim::Sim),
    /// The real cell
    #[command(subcommand)]
    Cell(cell::Cell),
    /// Robots that were calibrated
    #[command(subcommand)]
    Keep(keep::Keep),
    /// What can be wrong with an arm
    Effects(effects::Arguments),
    /// Compare methods of calibration on the same divisions of public data
    Bench(bench::Arguments),
    /// The built-in arms and others
    Robots(robots::Arguments),
    /// Print the script by which a shell completes verbs and options
    Completions(shell::Completions),
    /// Write the manual pages
    Man(shell::Man),
    /// Run the whole procedure on a simulated cell, as `sim run`
    #[command(hide = true)]
    Run(run::Arguments),
}

/// The command line, with its help.
fn command() -> clap::Command {
    help::told(Arguments::command())
}

/// Runs the program with the arguments of the process.
pub fn main() -> ExitCode {
    main_with(std::env::args_os())
}

/// Runs the program with these arguments; the first is the program's name.
pub fn main_with(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    let mut command = command();
    let parsed =
        command.try_get_matches_from_mut(arguments).and_then(|matches| Ok((Arguments::from_arg_matches(&matches)?, matches)));
    let (arguments, matches) = match parsed {
        Ok(parsed) => parsed,
        Err(e) => {
            // Help and version are not errors.
            if !e.use_stderr() || e.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
                drop(e.print());
                return ExitCode::from(if e.use_stderr() { BAD_INPUT } else { 0 });
            }
            return refuse(&moved::sentence(&e).unwrap_or_else(|| misuse(&e)), BAD_INPUT);
        }
    };
    let streams = Streams::of(&matches);
    output::print_in(Manner {
        columns: fitting::columns(arguments.wide),
        level: Level::of(arguments.quiet, arguments.verbose),
        colour: arguments.colour,
        beside: streams.holds_a_file(),
    });
    if let Some(problem) = streams.problem().or_else(|| overwritten::problem(&command, &matches)) {
        return refuse(&problem, BAD_INPUT);
    }
    let begun = Instant::now();
    let result = perform(&arguments.verb);
    output::print_detail(format!("{:.2} s in all", begun.elapsed().as_secs_f64()));
    ended(result)
}

/// Does what a verb is for.
fn perform(verb: &Verb) -> Result<Outcome, Failure> {
    match verb {
        Verb::Calibrate(a) => calibrate::run(a),
        Verb::Import(a) => import::run(a),
        Verb::Identify(a) => identify::run(a),
        Verb::Validate(a) => validate::run(a),
        Verb::Diagnose(a) => diagnose::run(a),
        Verb::Add(a) => add::run(a),
        Verb::Discover(a) => discover::run(a),
        Verb::Ladder(a) => ladder::run(a),
        Verb::Compare(a) => compare::run(a),
        Verb::Report(a) => report::run(a),
        Verb::Workbench(a) => workbench::run(a),
        Verb::Compensate(a) => compensate::run(a),
        Verb::Plan(a) => plan::run(a),
        Verb::Measure(a) => measure::run(a),
        Verb::Sim(verb) => verb.run(),
        Verb::Cell(verb) => verb.run(),
        Verb::Keep(verb) => verb.run(),
        Verb::Effects(a) => effects::run(a),
        Verb::Bench(a) => bench::run(a),
        Verb::Robots(a) => robots::run(a),
        Verb::Completions(a) => shell::completions(a),
        Verb::Man(a) => shell::man(a),
        Verb::Run(a) => run::run(a),
    }
}

/// The exit code of a verb that has ended, its error printed.
fn ended(result: Result<Outcome, Failure>) -> ExitCode {
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
            let hint = hint(failure.as_ref()).map(|hint| format!("; {hint}")).unwrap_or_default();
            refuse(&format!("{}{hint}", with_reasons(failure.as_ref())), code)
        }
    }
}

/// Prints one line on standard error and returns that exit code.
fn refuse(message: &str, code: u8) -> ExitCode {
    tell(format!("calibench: {}", one_line(message)));
    ExitCode::from(code)
}

/// Describes the error of a command line in one line.
fn misuse(error: &clap::Error) -> String {
    let text = error.render().to_string();
    // The paragraphs after the first show the usage, for which --help is better; tips and lists of values are kept.
    let lines = text.lines().map(str::trim).take_while(|l| !l.starts_with("Usage:") && !l.starts_with("For more information"));
    let lines: Vec<&str> = lines.filter(|l| !l.is_empty()).collect();
    format!("{}; `calibench --help` and `calibench VERB --help` say more", lines.join(" ").trim_start_matches("error: "))
}
