//! `keep`: the verbs for robots that were calibrated, as the time goes by.

use clap::Subcommand;

use super::{check, fleet, recover, runs};
use crate::terminal::failure::{Failure, Outcome};

#[derive(Subcommand)]
pub enum Keep {
    /// Check by a few poses measured again whether a calibration still holds, and what has changed if not; or choose those poses
    Check(check::Arguments),
    /// Find by a few touches after a crash which zeros were lost and what to enter, or plan these touches
    Recover(recover::Arguments),
    /// Compare many runs of one robot: what stayed, what moved, what belongs to one run only; and predict each from the others
    Runs(runs::Arguments),
    /// Learn from calibrations of robots of one type what they have in common: the prior of the next one
    Fleet(fleet::Arguments),
}

impl Keep {
    /// Does what the verb is for.
    pub fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Keep::Check(a) => check::run(a),
            Keep::Recover(a) => recover::run(a),
            Keep::Runs(a) => runs::run(a),
            Keep::Fleet(a) => fleet::run(a),
        }
    }
}
