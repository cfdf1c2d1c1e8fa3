//! `validate CALIBRATION DATASET...`.

use std::path::PathBuf;

use calibench::identify::calibration::Calibration;
use calibench::identify::problem::Use;
use calibench::judgement::ErrorTable;
use calibench::measure::dataset::{Dataset, NamedDataset, SampleSet};
use calibench::prediction::Extrapolation;
use calibench::residuals::Validation;
use calibench::units::MM;
use calibench_report::documents::{BeforeAndAfter, OutsideRange, Validated};
use calibench_report::{
    NOT_FITTED, NoForecast, RESIDUAL, documents, extrapolation_sentence, histogram, judged_alike, masses_sentence,
    orientation_table, rows_before, validation_row, validation_table,
};

use super::compare::of_fitted_rows;
use crate::arguments::data::{dataset, locate_in_data, named, read_calibration_to_use, read_datasets};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print, print_answer, print_json, warn};
use crate::terminal::streams::input;

#[derive(clap::Args)]
pub struct Arguments {
    /// Calibration file written by `identify`
    #[arg(value_parser = input())]
    calibration: PathBuf,
    /// Dataset folders; their rows of set 'validation' are used, or all rows if there are none
    #[arg(required = true, value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Estimate base, free tool and free balls from these data first, from rows of set 'fit' if there are any: base and tool
    /// were set up again for them
    #[arg(long)]
    set_up_anew: bool,
    /// Judge the very rows that were fitted: their residuals are no errors, and without this nothing held out is exit code 1
    #[arg(long)]
    fitted: bool,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut calibration = read_calibration_to_use(&arguments.calibration)?;
    if arguments.set_up_anew {
        calibration = calibration.set_up_anew();
    }
    let datasets = read_datasets(&arguments.datasets)?;
    let held_out = datasets.iter().any(|(_, d)| d.samples.iter().any(|s| s.set == SampleSet::Validation));
    let which = if held_out { Use::Validation } else { Use::All };
    let prediction =
        calibration.predict(&named(&datasets), which).map_err(|e| locate_in_data(&arguments.datasets, &datasets, None, &e))?;
    let validation = Validation::of(&prediction).ok_or("there are no samples to judge")?;
    let beyond =
        Extrapolation::of_samples(&calibration.robot, &calibration.joint_ranges, &calibration.model, &named(&datasets), |s| {
            which.takes(s)
        });
    if let Some(warning) = extrapolation_sentence(&beyond) {
        warn(&warning);
    }
    let is_fitted = |d: &Dataset| calibration.dataset_hashes.contains(&d.hash);
    // Rows to which the calibration was fitted have residuals, and no errors; under another name as well.
    let is_the_fit = !held_out && datasets.iter().all(|(_, d)| is_fitted(d));
    let fitted = calibration.fitted_rows.share(&named(&datasets), which);
    if let Some(share) = fitted.filter(|share| *share >= WORTH_A_WORD && !is_the_fit) {
        warn(&format!(
            "warning: about {:.0} % of these rows are the same as rows that were fitted, joints and readings: for those the figure is a residual, not an error; judge rows that were left out.",
            100.0 * share
        ));
    }
    // Where the fitted rows are among the data, what is expected at the judged ones is known.
    let expected = match held_out && datasets.iter().any(|(_, d)| d.samples.iter().any(|s| s.set == SampleSet::Fit)) {
        true => of_fitted_rows(&calibration, &named(&datasets)),
        false => Err(NoForecast::OtherRows),
    };
    let table = ErrorTable::of(&named(&datasets), &calibration, None);
    let residuals_only = is_the_fit || fitted.is_some_and(|share| share > 0.5);
    let outcome = if residuals_only && !arguments.fitted {
        warn(
            "Nothing is held out: these are the rows that were fitted, and their residuals are no errors. Hold rows out (set 'validation' in samples.csv, or `import ... --holdout`), or ask for residuals with --fitted.",
        );
        Outcome::ExpectationFailed
    } else {
        Outcome::Done
    };
    if arguments.json {
        print_json(&Validated {
            states: Some(BeforeAndAfter::of(&table, None)),
            errors: documents::Validation::of(&validation),
            outside_range: OutsideRange::of(&beyond),
            fitted,
            workspace: expected.as_ref().ok().map(documents::Workspace::of_forecast),
        })?;
        return Ok(outcome);
    }
    let figure = if residuals_only { RESIDUAL } else { NOT_FITTED };
    let name = format!("{}, {} samples", figure.name, validation.samples);
    print_answer(validation_table([rows_before(&table), vec![validation_row(&name, &validation)]].concat()))?;
    validation.orientation.iter().try_for_each(|errors| print_answer(orientation_table(errors)))?;
    masses_sentence(&calibration.robot).iter().try_for_each(|sentence| print(*sentence))?;
    if let Ok(forecast) = expected {
        print(forecast.sentence())?;
        let differs = judged_alike(&validation, &forecast.error, beyond.outside);
        differs.iter().try_for_each(|sentence| print(sentence))?;
    }
    other_base(&calibration, &named(&datasets), which, &validation).iter().try_for_each(|sentence| print_answer(sentence))?;
    print(histogram(&validation, 12))?;
    if !validation.from_fit_rows.is_empty() {
        print(format!(
            "Not in the calibration, so fitted to rows of set 'fit' first: {}",
            validation.from_fit_rows.join(", ")
        ))?;
    }
    if !validation.refitted.is_empty() {
        print(format!("Not in the calibration, so fitted to these samples first: {}", validation.refitted.join(", ")))?;
    }
    Ok(outcome)
}

/// Share of rows equal to fitted ones from which they are reported: an instrument of coarse steps reads the same again now and
/// then.
const WORTH_A_WORD: f64 = 0.1;

/// Share of the errors that remains with base and tool re-estimated, below which the rows are those of another set-up.
const ANOTHER: f64 = 0.2;

/// States that rows were measured from another place, or with another tool, if that is most of their error.
fn other_base(calibration: &Calibration, datasets: &[NamedDataset<'_>], which: Use, as_it_is: &Validation) -> Option<String> {
    let refitted = Validation::of(&calibration.set_up_anew().predict(datasets, which).ok()?)?;
    (refitted.rms < ANOTHER * as_it_is.rms).then(|| {
        format!(
            "With base and tool re-estimated (`--set-up-anew`) these rows leave {:.3} mm rms: the robot or the tracker has been moved since the calibration, or the tool is another one.",
            refitted.rms / MM
        )
    })
}
