//! Files as they were dropped, opened: a table is imported as `import guess` and `import generic` do, a dataset is read as it is.

use std::path::{Path, PathBuf};

use calibench::files::disk::{is_file, write_whole};
use calibench::files::{FileError, read_text, with_reasons};
use calibench::identify::calibration::CALIBRATION_FORMAT;
use calibench::identify::problem::Use;
use calibench::import::{ImportError, ImportOptions, guess, import};
use calibench::measure::dataset::file::{DATASET_TOML, read_dataset, write_dataset};
use calibench::measure::dataset::{Dataset, NamedDataset, SampleSet};
use calibench::residuals::misfit::data_fit;
use calibench::robot::robot_file::{RobotReference, robot};
use calibench::units::MM;
use calibench_report::{misfit_sentence, nominal_fit_lines};
use calibench_workbench::{Bench, Case, LocatedError, Place, copied_rows, locate_in_data, located_misfit};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::host::Host;

/// Folder of what is saved, in memory.
pub(crate) const SAVED: &str = "";

/// The rows of a dataset.
const SAMPLES_CSV: &str = "samples.csv";

/// The column map that is proposed for a table.
const MAP: &str = "map.toml";

/// Files to be opened, as they were dropped.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpenRequest {
    /// Their names.
    pub files: Vec<String>,
    /// A built-in robot, for tables without a robot file beside them.
    #[serde(default)]
    pub robot: Option<String>,
    /// Continue with data that do not fit the robot.
    #[serde(default)]
    pub force: bool,
}

/// Reasons why files were not opened.
#[derive(Debug, thiserror::Error)]
pub enum NotOpened {
    /// A file is not as it must be.
    #[error("{}", with_reasons(.0.as_ref()))]
    File(Box<FileError>),
    /// A table cannot be imported.
    #[error("{}", with_reasons(.0.as_ref()))]
    Import(Box<ImportError>),
    /// The data do not determine the model.
    #[error(transparent)]
    Data(Box<LocatedError>),
    /// The data do not fit the robot.
    #[error("{0}")]
    Misfit(String),
    /// The model cannot be judged on the data.
    #[error("{0}")]
    NotJudged(String),
    /// Several tables without a map.
    #[error("guess reads one file at a time; the map that it proposes serves all files of its kind: drop it beside them")]
    OneTable,
    /// Something is missing.
    #[error("{0}")]
    Missing(&'static str),
    /// Several files where one can be used.
    #[error("{0} and {1} are both {2}; drop one of them")]
    Both(String, String, &'static str),
    /// A robot cannot be simulated.
    #[error("{0}")]
    Simulation(String),
}

impl From<FileError> for NotOpened {
    fn from(error: FileError) -> Self {
        NotOpened::File(Box::new(error))
    }
}

impl From<ImportError> for NotOpened {
    fn from(error: ImportError) -> Self {
        NotOpened::Import(Box::new(error))
    }
}

impl From<LocatedError> for NotOpened {
    fn from(error: LocatedError) -> Self {
        NotOpened::Data(Box::new(error))
    }
}

impl NotOpened {
    /// The field of the page in error: `misfit` if the user may continue anyway.
    #[must_use]
    pub fn field(&self) -> Option<&'static str> {
        match self {
            NotOpened::Misfit(_) => Some("misfit"),
            NotOpened::Missing(_) => Some("robot"),
            _ => None,
        }
    }
}

/// Opened data.
pub struct Opened {
    /// The workbench on it.
    pub bench: Bench,
    /// Summary that the page shows.
    pub told: Value,
}

/// The dropped files by what they are for.
#[derive(Default)]
struct Dropped {
    tables: Vec<PathBuf>,
    datasets: Vec<PathBuf>,
    map: Option<PathBuf>,
    model: Option<PathBuf>,
    robot: Option<PathBuf>,
    /// Files that are not used, and why.
    left_out: Vec<String>,
}

/// Takes a file for what there is one of.
fn take_one(place: &mut Option<PathBuf>, path: PathBuf, what: &'static str) -> Result<(), NotOpened> {
    match place.replace(path.clone()) {
        Some(other) => Err(NotOpened::Both(other.display().to_string(), path.display().to_string(), what)),
        None => Ok(()),
    }
}

/// True of the text of a calibration.
fn is_calibration(text: &str) -> bool {
    let value = text.lines().find_map(|line| line.trim_start().strip_prefix("format")?.trim_start().strip_prefix('='));
    value.is_some_and(|value| value.contains(CALIBRATION_FORMAT))
}

impl Dropped {
    fn of(files: &[String]) -> Result<Self, NotOpened> {
        let mut dropped = Dropped::default();
        let is_in_dataset = |path: &Path| is_file(&path.with_file_name(DATASET_TOML));
        for path in files.iter().map(PathBuf::from) {
            let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
            match extension.as_str() {
                "toml" if path.ends_with(DATASET_TOML) => {
                    dropped.datasets.push(path.parent().unwrap_or(Path::new("")).to_owned());
                }
                // The robot of a dataset, or something else that its folder holds.
                _ if is_in_dataset(&path) && !path.ends_with(SAMPLES_CSV) && extension != "toml" => {}
                _ if is_in_dataset(&path) && path.ends_with(SAMPLES_CSV) => {}
                "toml" => {
                    let text = read_text(&path)?;
                    let has = |key: &str| text.lines().any(|line| line.trim_start().starts_with(key));
                    if is_calibration(&text) {
                        dropped.left_out.push(format!("{}: is a calibration, and is left out", path.display()));
                    } else if has("[columns") || has("columns") {
                        take_one(&mut dropped.map, path, "column maps")?;
                    } else if has("effects") {
                        take_one(&mut dropped.model, path, "models")?;
                    } else if !is_in_dataset(&path) {
                        take_one(&mut dropped.robot, path, "robots")?;
                    }
                }
                "urdf" => take_one(&mut dropped.robot, path, "robots")?,
                _ => dropped.tables.push(path),
            }
        }
        Ok(dropped)
    }
}

/// Opens files; `told` receives what was understood of them, also if they are not opened.
///
/// # Errors
/// The sentence that the command line prints.
pub fn open(request: &OpenRequest, host: Host, told: &mut Value) -> Result<Opened, NotOpened> {
    let mut dropped = Dropped::of(&request.files)?;
    let named = dropped.robot.as_ref().map(|path| path.display().to_string());
    let robot_name = named.or_else(|| request.robot.clone());
    told["left_out"] = json!(dropped.left_out);
    if !dropped.tables.is_empty() {
        let folder = import_tables(&dropped, robot_name.as_deref(), request.force, host, told)?;
        dropped.datasets.push(folder);
    }
    if dropped.datasets.is_empty() {
        return Err(NotOpened::Missing("there are no measurements among the files; drop a table, or the folder of a dataset"));
    }
    host.tell("Reading …");
    let mut datasets: Vec<(String, Dataset)> = Vec::new();
    for folder in &dropped.datasets {
        let name = folder.file_name().map_or_else(|| "dataset".to_owned(), |name| name.to_string_lossy().into_owned());
        datasets.push((name, read_dataset(folder)?));
    }
    let urdf = dropped.robot.as_ref().filter(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("urdf")));
    let place = Place::new(SAVED.into(), dropped.model.clone()).with_urdf(urdf.map(|path| path.display().to_string()));
    open_datasets(&dropped.datasets, datasets, dropped.model.as_deref(), place, Opening { force: request.force, host }, told)
}

/// How data are opened.
#[derive(Clone, Copy)]
pub(crate) struct Opening {
    /// Also if they do not fit their robot.
    pub force: bool,
    /// The page.
    pub host: Host,
}

/// Opens datasets that were read from these folders.
pub(crate) fn open_datasets(
    folders: &[PathBuf],
    datasets: Vec<(String, Dataset)>,
    model: Option<&Path>,
    place: Place,
    opening: Opening,
    told: &mut Value,
) -> Result<Opened, NotOpened> {
    let Opening { force, host } = opening;
    host.tell("Checking that the data fit the robot …");
    let borrowed: Vec<NamedDataset<'_>> = datasets.iter().map(|(name, d)| NamedDataset::new(name.as_str(), d)).collect();
    // Data of different arms are rejected as such by the fit.
    let one_arm = datasets.iter().all(|(_, d)| d.robot.is_same_arm(&datasets[0].1.robot));
    let fits = if one_arm { data_fit(&borrowed, Use::Fit) } else { Vec::new() };
    if let (Some(copied), false) = (copied_rows(&datasets), force) {
        return Err(copied.into());
    }
    let misfits: Vec<(String, String)> = fits
        .iter()
        .filter_map(|fit| fit.misfit.as_ref())
        .map(|misfit| (misfit.nominal.dataset.clone(), located_misfit(misfit)))
        .collect();
    if let (Some((_, sentence)), false) = (misfits.first(), force) {
        return Err(NotOpened::Misfit(sentence.clone()));
    }
    let warnings: Vec<String> = datasets
        .iter()
        .flat_map(|(name, d)| d.long_sessions().into_iter().map(move |s| format!("{name}/{SAMPLES_CSV}: {s}")))
        .collect();
    let samples: usize = datasets.iter().map(|(_, d)| d.samples.len()).sum();
    let of_validation = |d: &Dataset| d.samples.iter().filter(|s| s.set == SampleSet::Validation).count();
    let validation: usize = datasets.iter().map(|(_, d)| of_validation(d)).sum();
    told["robot"] = json!(datasets[0].1.robot.name);
    told["samples"] = json!(samples);
    told["validation"] = json!(validation);
    told["nominal"] = json!(nominal_fit_lines(&fits));
    told["misfit"] = json!(misfits.first().map(|(_, sentence)| sentence));
    told["warnings"] = json!(
        [told["left_out"].as_array().cloned().unwrap_or_default(), warnings.into_iter().map(Value::from).collect()].concat()
    );
    host.tell("Fitting the model …");
    let case = Case { misfits, worker: host.worker, ..Case::of_datasets(folders, datasets, model)? };
    let bench = Bench::new(case, place).map_err(|(case, e)| locate_in_data(folders, &case.datasets, model, &e))?;
    host.tell("Judging the model …");
    // What cannot be judged does not take the place of what is open.
    bench.document().map_err(|e| NotOpened::NotJudged(e.to_string()))?;
    Ok(Opened { bench, told: told.take() })
}

/// Imports the tables into a dataset beside them, and returns its folder.
fn import_tables(
    dropped: &Dropped,
    named: Option<&str>,
    force: bool,
    host: Host,
    told: &mut Value,
) -> Result<PathBuf, NotOpened> {
    let first = &dropped.tables[0];
    let map = match &dropped.map {
        Some(map) => map.clone(),
        None if dropped.tables.len() > 1 => {
            return Err(NotOpened::OneTable);
        }
        None => {
            let Some(named) = named else {
                return Err(NotOpened::Missing(
                    "guess needs the robot; choose one, or drop a robot file or a URDF beside the table",
                ));
            };
            let of = robot(named, Path::new(""))?;
            host.tell("Guessing what the columns are …");
            let found = guess(first, &of, RobotReference::parse(named).name)?;
            write_whole(Path::new(MAP), found.map.as_bytes())?;
            told["guess"] = json!({"map": found.map, "reasons": found.reasons, "rows": found.shown,
                "nominal_rms_mm": found.residual / MM});
            MAP.into()
        }
    };
    host.tell("Importing …");
    let options = ImportOptions { map: Some(map), ..ImportOptions::default() };
    let (dataset, report) = import("generic", &dropped.tables, &options)?;
    let misfit = data_fit(&[NamedDataset::new("", &dataset)], Use::All).into_iter().find_map(|fit| fit.misfit);
    if let (Some(misfit), false) = (&misfit, force) {
        return Err(NotOpened::Misfit(misfit_sentence(misfit)));
    }
    told["import"] = json!(report.to_string());
    let stem = PathBuf::from(first.file_stem().unwrap_or_default());
    // A table without an extension already has this name.
    let folder = if dropped.tables.contains(&stem) { PathBuf::from("imported") } else { stem };
    write_dataset(&dataset, &folder)?;
    Ok(folder)
}
