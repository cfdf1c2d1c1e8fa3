//! Datasets as the input of a page, and whose fault it is if they cannot be.

use std::path::{Path, PathBuf};

use calibench::effects::Subject;
use calibench::files::{FileError, with_reasons};
use calibench::identify::calibration::IdentifyError;
use calibench::identify::model_file::read_model;
use calibench::identify::problem::{ProblemError, Use};
use calibench::identify::{Model, are_copied};
use calibench::measure::dataset::{Dataset, Sample};
use calibench::residuals::misfit::Misfit;

use crate::case::Case;
use calibench_report::{Recommended, misfit_sentence};

/// An error attributed to a file or folder that the error itself does not know.
#[derive(Debug, thiserror::Error)]
#[error("{}: {field}: {problem}", path.display())]
pub struct LocatedError {
    /// The file or folder.
    pub path: PathBuf,
    /// The key or column.
    pub field: &'static str,
    /// The problem, and the remedy.
    pub problem: String,
}

/// Attributes an identification error to the data or to the model.
#[must_use]
pub fn locate_in_data(
    folders: &[PathBuf],
    datasets: &[(String, Dataset)],
    model: Option<&Path>,
    error: &IdentifyError,
) -> LocatedError {
    let at = |k: usize, file: &str| folders.get(k).map(|f| f.join(file)).unwrap_or_default();
    let of_robot = |name: &str| datasets.iter().position(|(_, d)| d.robot.name == name).unwrap_or(0);
    let (path, field) = match (error, model) {
        (
            IdentifyError::OtherRobot { measured: other, .. }
            | IdentifyError::Problem(ProblemError::DifferentRobots { other, .. }),
            _,
        ) => (at(of_robot(other), "dataset.toml"), "robot"),
        (IdentifyError::Problem(ProblemError::Effect(_) | ProblemError::Missing { .. }), Some(model)) => {
            (model.to_owned(), "effects")
        }
        (IdentifyError::Problem(ProblemError::NoSamples { .. }), _) => (at(0, "samples.csv"), "set"),
        _ => (at(0, "samples.csv"), "rows"),
    };
    LocatedError { path, field, problem: with_reasons(error) }
}

/// Says which dataset repeats the rows of another; `None` if none does.
///
/// Each measurement would count twice: every uncertainty would be too small, and rows left out would be predicted by their copies.
#[must_use]
pub fn copied_rows(datasets: &[(String, Dataset)]) -> Option<LocatedError> {
    fn rows(dataset: &Dataset) -> impl Iterator<Item = &Sample> {
        dataset.samples.iter().filter(|s| Use::Fit.takes(s))
    }
    // Data of different arms are refused as such.
    let copies = |a: &Dataset, b: &Dataset| {
        a.robot.is_same_arm(&b.robot) && (are_copied(rows(a), rows(b)) || are_copied(rows(b), rows(a)))
    };
    datasets.iter().enumerate().find_map(|(k, (name, dataset))| {
        let (other, _) = datasets[..k].iter().find(|(_, earlier)| copies(dataset, earlier))?;
        let problem = format!("most of them are also in {other}, and would count twice; leave one of the two out");
        Some(LocatedError { path: Path::new(name).join("samples.csv"), field: "rows", problem })
    })
}

/// A misfit in words, prefixed with the file to look into; of data that have no folder yet, without one.
#[must_use]
pub fn located_misfit(misfit: &Misfit) -> String {
    match misfit.nominal.dataset.as_str() {
        "" => misfit_sentence(misfit),
        name => format!("{name}/samples.csv: {}", misfit_sentence(misfit)),
    }
}

/// The model of the given file, or the default model for the data.
///
/// # Errors
/// If the file is not a model of this robot.
pub fn model_for(path: Option<&Path>, datasets: &[(String, Dataset)]) -> Result<Model, FileError> {
    let first = &datasets[0].1;
    Ok(match path {
        Some(path) => read_model(path, &Subject::new(&first.robot, &first.ball_ids()))?,
        None => Model::default_for(first),
    })
}

impl Case {
    /// The case of datasets read from these folders, with the initial model of a file, or the default one.
    ///
    /// # Errors
    /// If the file is not a model of this robot.
    pub fn of_datasets(folders: &[PathBuf], datasets: Vec<(String, Dataset)>, model: Option<&Path>) -> Result<Self, FileError> {
        let names: Vec<&str> = datasets.iter().map(|(name, _)| name.as_str()).collect();
        Ok(Case {
            title: names.join(", "),
            question: None,
            misfits: Vec::new(),
            model: model_for(model, &datasets)?,
            judged: None,
            commands: Recommended::of(folders, model),
            commands_from: String::new(),
            campaign: None,
            pictures: Vec::new(),
            run: None,
            worker: None,
            datasets,
        })
    }
}
