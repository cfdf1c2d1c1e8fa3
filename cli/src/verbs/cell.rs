//! `cell check CELL`, `cell program -o FOLDER`, `cell repeatability`: preparation of a cell for measurements.

pub(super) mod check;

use std::path::PathBuf;

use calibench::files::disk::write_whole;
use calibench_wire::kuka::program_files;
use calibench_wire::ur::PROGRAM;
use clap::Subcommand;

use super::repeatability;
use crate::arguments::choices::MakeChoice;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::print_answer;

#[derive(Subcommand)]
pub enum Cell {
    /// Query every device of a cell and report its state; nothing moves, and no setting changes except the indicators' unit,
    /// set to millimetres
    Check {
        /// Cell file
        cell: PathBuf,
    },
    /// Write the program that moves a robot for calibench; of a KUKA also the lines to add to its $config.dat
    Program {
        /// Make of the robot. A Universal Robot is sent its program by `measure`
        #[arg(long, value_enum, default_value_t)]
        robot: MakeChoice,
        /// Output folder for the program
        #[arg(short, long, visible_alias = "out")]
        output: PathBuf,
    },
    /// Measure the robot's repeatability (RP after ISO 9283) and the lost motion of each joint on reversal, with the gauge
    Repeatability(repeatability::Arguments),
}

impl Cell {
    /// Does what the verb is for.
    pub fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Cell::Check { cell } => check::run(cell),
            Cell::Program { robot, output } => {
                let (files, how) = match robot {
                    MakeChoice::Kuka => (program_files().to_vec(), "docs/cell.md describes how to set it up"),
                    MakeChoice::Ur => (vec![("calibench.script", PROGRAM.to_owned())], "`measure` sends it to the controller"),
                };
                for (name, text) in files {
                    write_whole(&output.join(name), text.as_bytes())?;
                }
                print_answer(format!("the program for the controller is in {}; {how}", output.display()))?;
                Ok(Outcome::Done)
            }
            Cell::Repeatability(a) => repeatability::run(a),
        }
    }
}
