//! `compare CALIBRATION DATASET...`.

use std::path::PathBuf;

use calibench::assess::{Comparison, Examination, Extrapolation, WorkspacePoses};
use calibench::files::check_output_folder;
use calibench::identify::{Calibration, IdentifyError, Use};
use calibench::measure::Dataset;
use calibench::report::{
    Outlook, PLOTS_MARK, comparison_json, comparison_text, extrapolation_sentence, write_comparison_plots,
};

use super::progress::Waiting;
use super::{Failure, Outcome, blame_data, named, outlook, print, print_json, read_calibration_to_use, read_datasets};

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
    if let Some(folder) = &arguments.plots {
        check_output_folder(folder, "comparison", PLOTS_MARK)?;
    }
    let mut calibration = read_calibration_to_use(&arguments.calibration)?;
    if arguments.set_up_anew {
        calibration = calibration.set_up_anew();
    }
    let datasets = read_datasets(&arguments.datasets)?;
    let which = match (arguments.all, arguments.validation) {
        (true, _) => Use::All,
        (_, true) => Use::Validation,
        _ => Use::Fit,
    };
    let waiting = Waiting::new("comparing");
    let comparison = Comparison::of(&calibration, &named(&datasets), which)
        .map_err(|e| blame_data(&arguments.datasets, &datasets, None, &e))?;
    let beyond =
        Extrapolation::of_samples(&calibration.joint_ranges, &calibration.model, &named(&datasets), |s| which.takes(s));
    if let Some(warning) = extrapolation_sentence(&beyond) {
        waiting.say(&warning);
    }
    let outlook = of_fitted_rows(&calibration, &named(&datasets));
    drop(waiting);
    if let Some(folder) = &arguments.plots {
        write_comparison_plots(&comparison, outlook.as_ref().ok(), folder)?;
    }
    if arguments.json {
        print_json(&comparison_json(&comparison, outlook.as_ref().ok(), &beyond))?;
    } else {
        print(&comparison_text(&comparison, &outlook))?;
    }
    Ok(Outcome::Done)
}

/// The error to expect over the workspace, from the rows that the calibration was fitted to; else why it cannot be told.
fn of_fitted_rows(calibration: &Calibration, datasets: &[(&str, &Dataset)]) -> Result<Outlook, String> {
    let why = |e: IdentifyError| format!("The position error to expect over the workspace cannot be told: {e}.");
    let of_hash = |hash: &String| datasets.iter().find(|(_, d)| d.hash == *hash).copied();
    let mut fitted: Vec<(&str, &Dataset)> = calibration.dataset_hashes.iter().filter_map(of_hash).collect();
    if fitted.is_empty() || fitted.len() < calibration.dataset_hashes.len() {
        // A calibration that knows no file is told by its numbers: they are the best for these rows.
        let has_fit_rows = |d: &Dataset| d.samples.iter().any(|s| Use::Fit.takes(s));
        fitted = datasets.iter().copied().filter(|(_, d)| has_fit_rows(d)).collect();
        let is_fit = |rows: &[(&str, &Dataset)]| Comparison::of(calibration, rows, Use::Fit).is_ok_and(|c| c.standing.fitted);
        if fitted.is_empty() || !is_fit(&fitted) {
            return Err("The position error to expect over the workspace cannot be told from these data: it takes the rows to which the calibration was fitted; name their dataset as well."
                .into());
        }
    }
    let examination = Examination::new(&fitted, &calibration.model).map_err(why)?;
    outlook(&fitted, &examination, &WorkspacePoses::of(datasets)).map_err(why)?
}
