//! `sim`: the verbs of the simulated cell.

use clap::Subcommand;

use super::{design, merge, precision, run, serve, study, suite};
use crate::terminal::failure::{Failure, Outcome};

#[derive(Subcommand)]
pub enum Sim {
    /// Run the whole procedure on a simulated cell (plan, master, probe, identify, validate) and check the scenario's
    /// expectations; `calibench run` is the same
    Run(run::Arguments),
    /// Serve the simulated cell over the interfaces of a real one: three indicators and a robot that any program can talk to
    Serve(serve::Arguments),
    /// Repeat the whole procedure with every error sampled again: the spread of its results, at one point or along a sweep
    Study(study::Arguments),
    /// Combine the shards of a study and summarise them
    Merge(merge::Arguments),
    /// Run blind trials of the diagnosis against the ground truth
    Suite(suite::Arguments),
    /// Place the balls of an artifact: smallest worst-case uncertainty over the workspace, against size and weight
    Design(design::Arguments),
    /// Estimate the distance of a centred ball from the master ball's position (paper Table 3), and its error budget
    Precision(precision::Arguments),
}

impl Sim {
    /// Does what the verb is for.
    pub fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Sim::Run(a) => run::run(a),
            Sim::Serve(a) => serve::run(a),
            Sim::Study(a) => study::run(a),
            Sim::Merge(a) => merge::run(a),
            Sim::Suite(a) => suite::run(a),
            Sim::Design(a) => design::run(a),
            Sim::Precision(a) => precision::run(a),
        }
    }
}
