//! `keep fleet CALIBRATION... -o FLEET`: what robots of one type have in common.

use std::path::PathBuf;

use calibench::identify::calibration::Calibration;
use calibench::identify::fleet::{Fleet, SeemOne, write_fleet};
use calibench_report::{documents, fleet_text};

use crate::arguments::data::read_calibration_to_use;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print, print_answer, print_json, warn};
use crate::terminal::streams::output;

#[derive(clap::Args)]
pub struct Arguments {
    /// Calibration files of robots of one type, one for each
    #[arg(required = true)]
    calibrations: Vec<PathBuf>,
    /// Output file for the fleet (TOML); an existing file is replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    let read = |path: &PathBuf| -> Result<(String, Calibration), Failure> {
        Ok((path.display().to_string(), read_calibration_to_use(path)?))
    };
    let read: Vec<(String, Calibration)> = arguments.calibrations.iter().map(read).collect::<Result<_, _>>()?;
    let named: Vec<(&str, &Calibration)> = read.iter().map(|(name, c)| (name.as_str(), c)).collect();
    let fleet = Fleet::of(&named)?;
    for SeemOne { name, other, differ, alike } in SeemOne::of(&named) {
        warn(&format!(
            "warning: {name} seems to be of the robot of {other}: their parameters differ by {differ:.1} times their standard uncertainty, where those of two robots that are very much alike differ by {alike:.1}. A robot that counts twice makes its type seem more alike than it is: leave one out, unless they are two."
        ));
    }
    if let Some(path) = &arguments.output {
        write_fleet(&fleet, path)?;
    }
    if arguments.json {
        print_json(&documents::Fleet::of(&fleet))?;
        return Ok(Outcome::Done);
    }
    if arguments.output.is_some() { print(fleet_text(&fleet)) } else { print_answer(fleet_text(&fleet)) }?;
    if let Some(path) = &arguments.output {
        print_answer(format!("The fleet is in {}.", path.display()))?;
    }
    Ok(Outcome::Done)
}
