//! `effects prove DATASET...`: what the data can show; with a way of dividing them, whether the advice holds on postures left out.

mod divisions;
mod injections;

use std::path::PathBuf;

use calibench::identify::problem::Use;
use calibench::measure::dataset::Dataset;
use calibench_lab::injection::NoiseChoice;

use crate::arguments::choices::seed;
use crate::arguments::data::dataset;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::streams::{input, output};

/// Number of random parts of the postures if other divisions are requested.
const FOLDS: usize = 5;

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders; injections are into all of them as data of one robot, divisions are of each separately
    #[arg(required = true, value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Model file; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long, conflicts_with_all = DIVIDING, value_parser = input())]
    model: Option<PathBuf>,
    /// Noise of the injected measurements: that of the instrument, stated or from repeats, shows what the data can show once
    /// everything else is modelled; the residual of the fit, what they can show beside all that the model lacks today
    #[arg(long, value_enum, default_value_t = Noise::Instrument, conflicts_with_all = DIVIDING)]
    noise: Noise,
    /// Inject only this effect or family; repeat for several
    #[arg(long = "effect", value_name = "ID", conflicts_with_all = DIVIDING)]
    effects: Vec<String>,
    /// Number of trials in which nothing is injected
    #[arg(long, value_name = "TRIALS", default_value_t = 20, conflicts_with_all = DIVIDING)]
    nothing: usize,
    /// Continue with data that do not fit the robot
    #[arg(long, conflicts_with_all = DIVIDING)]
    force: bool,
    /// Divide the postures into this number of random parts, left out one after the other; 0 for none. With another division,
    /// the default is 5
    #[arg(long, help_heading = DIVISIONS)]
    folds: Option<usize>,
    /// Number of parts of joint space, each of neighbouring postures, also left out one after the other; 0 for none
    #[arg(long, default_value_t = 0, help_heading = DIVISIONS)]
    blocks: usize,
    /// Also leave out the places of an artifact: balls whose names agree before a slash
    #[arg(long, help_heading = DIVISIONS)]
    places: bool,
    /// Also predict each dataset by the robot of the others: they are campaigns of one robot
    #[arg(long, help_heading = DIVISIONS)]
    campaigns: bool,
    /// Also fit campaigns of only this number of postures
    #[arg(long, value_name = "POSTURES", help_heading = DIVISIONS)]
    short: Option<usize>,
    /// Number of such short campaigns drawn from each dataset
    #[arg(long, default_value_t = 5, requires = "short", help_heading = DIVISIONS)]
    draws: usize,
    /// Folder for the rows of every division, one CSV file each: joints, and the residual of the default model; existing files
    /// are replaced
    #[arg(long, value_name = "DIR", help_heading = DIVISIONS)]
    rows: Option<PathBuf>,
    /// Largest number of rows used of each dataset, spread over it; of injections, 2000 fitted rows unless stated
    #[arg(long, value_name = "ROWS")]
    at_most: Option<usize>,
    /// Seed of the random choices
    #[arg(long, value_parser = seed, allow_negative_numbers = true, default_value_t = 1)]
    seed: u64,
    /// Output file for the table: a page if its name ends in .html, otherwise Markdown; an existing file is replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

const DIVISIONS: &str = "Divisions: test the advice on postures left out";

/// The options that divide the data.
const DIVIDING: [&str; 6] = ["folds", "blocks", "places", "campaigns", "short", "rows"];

#[derive(Clone, Copy, clap::ValueEnum)]
enum Noise {
    Instrument,
    Residual,
}

impl From<Noise> for NoiseChoice {
    fn from(noise: Noise) -> Self {
        match noise {
            Noise::Instrument => NoiseChoice::Instrument,
            Noise::Residual => NoiseChoice::Residual,
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let Arguments { folds, blocks, places, campaigns, short, rows, .. } = arguments;
    if folds.is_some() || *blocks > 0 || *places || *campaigns || short.is_some() || rows.is_some() {
        divisions::run(arguments)
    } else {
        injections::run(arguments)
    }
}

/// Keeps at most `at_most` of the rows that `which` takes, spread over the whole.
pub(super) fn thin(dataset: &mut Dataset, at_most: usize, which: Use) {
    let count = dataset.samples.iter().filter(|s| which.takes(s)).count();
    let mut place = 0;
    dataset.samples.retain(|sample| {
        if at_most >= count || !which.takes(sample) {
            return true;
        }
        place += 1;
        (place - 1) * at_most / count != place * at_most / count
    });
}
