//! `check CALIBRATION --then CAMPAIGN [DATASET]`: whether a calibration still holds, by a few poses measured again.

use std::path::PathBuf;

use calibench::assess::{CheckError, RobotCheck, choose_sentinels, power_of_check};
use calibench::files::with_reasons;
use calibench::measure::Dataset;
use calibench_report::{check_plan_text, check_text, documents};

use super::data::{read_calibration_to_use, read_datasets};
use super::failure::{Failure, LocatedError, Outcome};
use super::output::{print, print_json};
use super::progress::Waiting;

/// Sizes for which the power of a check is printed, in units of the noise of one comparison.
const SIZES: [f64; 4] = [1.0, 2.0, 3.0, 5.0];

#[derive(clap::Args)]
pub struct Arguments {
    /// Calibration file written by `identify`
    calibration: PathBuf,
    /// Dataset folder of the check: some poses of the campaign, measured again; without it the check is planned
    dataset: Option<PathBuf>,
    /// Dataset folder of the campaign that was calibrated, or of an earlier check: what the new measurements are compared with
    #[arg(long, value_name = "CAMPAIGN")]
    then: PathBuf,
    /// Number of poses to choose, if the check is planned
    #[arg(long, default_value_t = 5, conflicts_with = "dataset", value_parser = clap::value_parser!(u16).range(1..=100))]
    sentinels: u16,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let calibration = read_calibration_to_use(&arguments.calibration)?;
    let read = |folder: &PathBuf| -> Result<(String, Dataset), Failure> {
        let mut datasets = read_datasets(std::slice::from_ref(folder))?;
        Ok(datasets.remove(0))
    };
    let (name, campaign) = read(&arguments.then)?;
    let then = (name.as_str(), &campaign);
    let Some(folder) = &arguments.dataset else {
        let waiting = Waiting::new("planning the check");
        let located = |e: CheckError| located(&arguments.then, &e);
        let chosen = choose_sentinels(&calibration, then, usize::from(arguments.sentinels)).map_err(located)?;
        let power = power_of_check(&calibration, then, &chosen, &SIZES).map_err(located)?;
        drop(waiting);
        let ids: Vec<String> = chosen.iter().map(|&k| campaign.samples[k].id.clone()).collect();
        if arguments.json {
            print_json(&documents::Check::of_plan(ids, &power))?;
        } else {
            print(&check_plan_text(&ids, &power))?;
        }
        return Ok(Outcome::Done);
    };
    let (_, now) = read(folder)?;
    // Both are of the calibration's set-up, whatever their folders are called.
    let check = RobotCheck::of(&calibration, then, (name.as_str(), &now)).map_err(|e| located(folder, &e))?;
    if arguments.json {
        print_json(&documents::Check::of(&check))?;
    } else {
        print(&check_text(&check))?;
    }
    Ok(if check.changed { Outcome::ExpectationFailed } else { Outcome::Done })
}

fn located(folder: &std::path::Path, error: &CheckError) -> Failure {
    let (file, field, remedy) = match error {
        CheckError::NoCounterpart { .. } => {
            ("samples.csv", "id", "; leave it out, or name the campaign in which it was measured with --then")
        }
        CheckError::NoNoise => ("dataset.toml", "noise", "; state it in [noise], or as sigma_um of the rows"),
        CheckError::OtherSetUp => ("dataset.toml", "base", "; check with the tool and base of the calibration"),
        CheckError::Nothing => ("samples.csv", "rows", "; measure some poses of the campaign again"),
        _ => ("samples.csv", "rows", ""),
    };
    Box::new(LocatedError { path: folder.join(file), field, problem: format!("{}{remedy}", with_reasons(error)) })
}
