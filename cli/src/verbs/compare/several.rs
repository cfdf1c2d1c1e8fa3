//! Several calibrations or models, side by side.

use std::path::{Path, PathBuf};

use calibench::files::read_text;
use calibench::judgement::side_by_side::{Compared, SideBySide};
use calibench::measure::dataset::Dataset;
use calibench_report::{documents, side_by_side_text};

use super::Arguments;
use crate::arguments::data::{model_for, named, read_calibration_to_use, read_datasets};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print_answer, print_json};
use crate::terminal::progress::Waiting;

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let (others, folders): (Vec<&PathBuf>, Vec<&PathBuf>) = arguments.datasets.iter().partition(|path| path.is_file());
    if folders.is_empty() {
        return Err("no dataset is given: the calibrations are compared on measurements; name a dataset folder as well".into());
    }
    if arguments.all || arguments.validation || arguments.plots.is_some() || arguments.set_up_anew {
        return Err("--validation, --all, --plots and --set-up-anew are for one calibration: several are judged on held-out rows, or, without any, on each row left out of a fit in turn".into());
    }
    let folders: Vec<PathBuf> = folders.into_iter().cloned().collect();
    let datasets = read_datasets(&folders)?;
    let files: Vec<&PathBuf> = std::iter::once(&arguments.calibration).chain(others).collect();
    let compared = files.iter().map(|file| Ok((file.display().to_string(), read(file, &datasets)?)));
    let compared = compared.collect::<Result<Vec<(String, Compared)>, Failure>>()?;
    let waiting = Waiting::new("comparing");
    let all = SideBySide::of(&named(&datasets), &compared)?;
    drop(waiting);
    if arguments.json {
        print_json(&documents::SideBySide::of(&all))?;
    } else {
        print_answer(side_by_side_text(&all))?;
    }
    Ok(Outcome::Done)
}

/// Reads a model, which lists effects and no estimates, or a calibration.
fn read(file: &Path, datasets: &[(String, Dataset)]) -> Result<Compared, Failure> {
    let table: Option<toml::Table> = read_text(file)?.parse().ok();
    let is_model = table.is_some_and(|t| t.contains_key("effects") && !t.contains_key("format"));
    Ok(if is_model {
        Compared::Model(Box::new(model_for(Some(file), datasets)?))
    } else {
        Compared::Calibration(Box::new(read_calibration_to_use(file)?))
    })
}
