//! `compare CALIBRATION DATASET...`.

use std::path::PathBuf;

use calibench::assess::Comparison;
use calibench::identify::{Use, read_calibration};
use calibench::report::{comparison_json, comparison_text, write_comparison_plots};

use super::{Failure, Outcome, blame_data, named, print, print_json, read_datasets};

#[derive(clap::Args)]
pub struct Arguments {
    /// A calibration that `identify` wrote
    calibration: PathBuf,
    /// Dataset folders: their rows of set 'fit'
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// Rows of set 'validation' in their place
    #[arg(long, conflicts_with = "all")]
    validation: bool,
    /// All rows
    #[arg(long)]
    all: bool,
    /// The robot was set up anew for these data: find its base, a free tool and free balls from them first
    #[arg(long)]
    set_up_anew: bool,
    /// Folder for one CSV file a view, for plotting; those of an earlier comparison are replaced
    #[arg(long, value_name = "DIR")]
    plots: Option<PathBuf>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut calibration = read_calibration(&arguments.calibration)?;
    if arguments.set_up_anew {
        calibration = calibration.set_up_anew();
    }
    let datasets = read_datasets(&arguments.datasets)?;
    let which = match (arguments.all, arguments.validation) {
        (true, _) => Use::All,
        (_, true) => Use::Validation,
        _ => Use::Fit,
    };
    let comparison = Comparison::of(&calibration, &named(&datasets), which)
        .map_err(|e| blame_data(&arguments.datasets, &datasets, None, &e))?;
    if let Some(folder) = &arguments.plots {
        write_comparison_plots(&comparison, folder)?;
    }
    if arguments.json {
        print_json(&comparison_json(&comparison))?;
    } else {
        print(&comparison_text(&comparison))?;
    }
    Ok(Outcome::Done)
}
