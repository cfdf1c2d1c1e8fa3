//! `validate CALIBRATION DATASET...`.

use std::path::PathBuf;

use calibench::assess::{Extrapolation, Validation};
use calibench::identify::Use;
use calibench::measure::SampleSet;
use calibench_report::documents::{OutsideRange, Validated};
use calibench_report::{documents, extrapolation_sentence, histogram, orientation_table, validation_row, validation_table};

use super::data::{locate_in_data, named, read_calibration_to_use, read_datasets};
use super::failure::{Failure, Outcome};
use super::output::{print, print_json};

#[derive(clap::Args)]
pub struct Arguments {
    /// Calibration file written by `identify`
    calibration: PathBuf,
    /// Dataset folders; their rows of set 'validation' are used, or all rows if there are none
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// Estimate base, free tool and free balls from these data first, from rows of set 'fit' if there are any: the robot was
    /// set up anew for them
    #[arg(long)]
    set_up_anew: bool,
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
        eprintln!("{warning}");
    }
    if arguments.json {
        print_json(&Validated { errors: documents::Validation::of(&validation), outside_range: OutsideRange::of(&beyond) })?;
        return Ok(Outcome::Done);
    }
    print(&validation_table(&[validation_row(&format!("{} samples", validation.samples), &validation)]))?;
    validation.orientation.iter().try_for_each(|errors| print(&orientation_table(errors)))?;
    print(&histogram(&validation, 12))?;
    if !validation.from_fit_rows.is_empty() {
        print(&format!(
            "Not in the calibration, so fitted to rows of set 'fit' first: {}",
            validation.from_fit_rows.join(", ")
        ))?;
    }
    if !validation.refitted.is_empty() {
        print(&format!("Not in the calibration, so fitted to these samples first: {}", validation.refitted.join(", ")))?;
    }
    Ok(Outcome::Done)
}
