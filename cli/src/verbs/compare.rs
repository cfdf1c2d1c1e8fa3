//! `compare CALIBRATION... DATASET...`: where one calibration fails, or several side by side.

mod several;

use std::path::PathBuf;

use calibench::diagnosis::{Diagnosis, Examination, diagnose};
use calibench::files::disk::check_output_folder;
use calibench::identify::calibration::Calibration;
use calibench::identify::problem::Use;
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::prediction::{Extrapolation, WorkspacePoses};
use calibench::residuals::comparison::Comparison;
use calibench_report::{
    Forecast, NoForecast, PLOTS_MARK, Printout, Recommended, abnormal_sentences, comparison_headline, comparison_sentences,
    comparison_text, documents, extrapolation_sentence, lacking_sentence, masses_sentence, write_comparison_plots,
};

use crate::arguments::data::{dataset, forecast, locate_in_data, named, read_calibration_to_use, read_datasets};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print, print_answer, print_json};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::input;

#[derive(clap::Args)]
pub struct Arguments {
    /// Calibration file written by `identify`
    #[arg(value_parser = input())]
    calibration: PathBuf,
    /// Dataset folders; their rows of set 'fit' are compared. Further calibration or model files before them: all are judged side
    /// by side, on rows that no fit has seen
    #[arg(required = true, value_name = "DATASET", value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Compare the rows of set 'validation' instead
    #[arg(long, conflicts_with = "all")]
    validation: bool,
    /// Compare all rows
    #[arg(long)]
    all: bool,
    /// Estimate base, free tool and free balls from these data first: base and tool were set up again for them
    #[arg(long)]
    set_up_anew: bool,
    /// Folder for plotting, with one CSV file per view; files of an earlier comparison are replaced
    #[arg(long, value_name = "DIR")]
    plots: Option<PathBuf>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if arguments.datasets.iter().any(|path| path.is_file()) {
        return several::run(arguments);
    }
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
        .map_err(|e| locate_in_data(&arguments.datasets, &datasets, None, &e))?;
    let beyond =
        Extrapolation::of_samples(&calibration.robot, &calibration.joint_ranges, &calibration.model, &named(&datasets), |s| {
            which.takes(s)
        });
    if let Some(warning) = extrapolation_sentence(&beyond) {
        waiting.warn(&warning);
    }
    let forecast = of_fitted_rows(&calibration, &named(&datasets));
    // Of the rows that were fitted, the first finding is that of their diagnosis: views show where, not why.
    let of_fit = comparison.fit_relation.fitted && which == Use::Fit;
    let diagnosis = of_fit.then(|| diagnose(&named(&datasets), &calibration.model).ok()).flatten();
    let first = diagnosis.as_ref().and_then(lacking_sentence);
    let abnormal = match diagnosis {
        Some(diagnosis) => diagnosis.abnormal,
        None => Diagnosis::abnormal_in(&named(&datasets), &calibration),
    };
    drop(waiting);
    if let Some(folder) = &arguments.plots {
        write_comparison_plots(&comparison, forecast.as_ref().ok(), folder)?;
    }
    if arguments.json {
        let mut document = documents::Comparison::of(&comparison, forecast.as_ref().ok(), &beyond);
        document.sentences.splice(0..0, first);
        print_json(&document)?;
    } else {
        abnormal_sentences(&abnormal).iter().try_for_each(|sentence| print_answer(sentence))?;
        print_answer(format!("{}\n", comparison_headline(&comparison)))?;
        masses_sentence(&calibration.robot).iter().try_for_each(|sentence| print(*sentence))?;
        first.iter().try_for_each(|sentence| print_answer(format!("* {sentence}")))?;
        comparison_sentences(&comparison, &forecast).iter().try_for_each(|sentence| print_answer(sentence))?;
        print(Printout::from("\n") + comparison_text(&comparison, &forecast))?;
        if !comparison.findings.is_empty() && which == Use::Fit {
            let commands = Recommended::of(&arguments.datasets, None);
            print_answer(format!("Next: `{}` shows which of these causes is likely.", commands.diagnose()))?;
        }
    }
    Ok(Outcome::Done)
}

/// The expected error over the workspace, from the rows that the calibration was fitted to; otherwise the reason why it cannot
/// be predicted.
pub(super) fn of_fitted_rows(calibration: &Calibration, datasets: &[NamedDataset<'_>]) -> Result<Forecast, NoForecast> {
    let of_hash = |hash: &String| datasets.iter().find(|d| d.dataset.hash == *hash).copied();
    let mut fitted: Vec<NamedDataset<'_>> = calibration.dataset_hashes.iter().filter_map(of_hash).collect();
    if fitted.is_empty() || fitted.len() < calibration.dataset_hashes.len() {
        // A calibration that lists none of these files is recognised by its values: they are optimal for these rows.
        let has_fit_rows = |d: &Dataset| d.samples.iter().any(|s| Use::Fit.takes(s));
        fitted = datasets.iter().copied().filter(|d| has_fit_rows(d.dataset)).collect();
        let is_fit =
            |rows: &[NamedDataset<'_>]| Comparison::of(calibration, rows, Use::Fit).is_ok_and(|c| c.fit_relation.fitted);
        if fitted.is_empty() || !is_fit(&fitted) {
            return Err(NoForecast::OtherRows);
        }
    }
    let examination = Examination::new(&fitted, &calibration.model).map_err(NoForecast::Failed)?;
    forecast(&fitted, &examination, &WorkspacePoses::of(datasets)).map_err(NoForecast::Failed)?
}
