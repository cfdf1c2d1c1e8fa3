//! Reading of the datasets, models and calibrations given to verbs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibench::diagnosis::Examination;
use calibench::effects::registry::Registry;
use calibench::identify::calibration::{Calibration, IdentifyError, read_calibration};
use calibench::identify::fit::Outcome;
use calibench::identify::fleet::{Fleet, FleetJudged, FleetPrior, PriorUsed, identify_with_fleet, read_fleet};
use calibench::identify::{Model, are_copied};
use calibench::measure::dataset::file::{DATASET_TOML, read_dataset};
use calibench::measure::dataset::{Dataset, NamedDataset, SampleSet};
use calibench::prediction::{Extrapolation, WorkspaceError, WorkspacePoses, undetermined};
use calibench::robot::BUILT_IN;
use calibench::robot::robot_file::RobotReference;
use calibench_report::documents::Run;
use calibench_report::{Forecast, NoForecast, extrapolation_sentence};
pub use calibench_workbench::{locate_in_data, model_for};
use clap::builder::{PathBufValueParser, TypedValueParser};

use crate::terminal::failure::{Failure, LocatedError};
use crate::terminal::output::{note, print_detail, warn};

/// File in the folder of a run that holds the model used for its calibration.
pub const MODEL: &str = "model.toml";

/// The folder of a dataset; of a run, that of the samples that it was calibrated with.
pub fn dataset() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(|folder| {
        let of_run = folder.join("trical");
        let is_run = !folder.join(DATASET_TOML).is_file() && folder.join(Run::FILE).is_file();
        if is_run && of_run.join(DATASET_TOML).is_file() { of_run } else { folder }
    })
}

/// The model of datasets: that of the file given or, if all of them are of runs, the model of these runs, which is named
/// unless it is the default one.
pub fn model_of(given: Option<&Path>, folders: &[PathBuf], datasets: &[(String, Dataset)]) -> Result<Model, Failure> {
    let default = model_for(given, datasets)?;
    let files: Vec<PathBuf> = folders.iter().filter_map(|folder| model_of_run(folder)).collect();
    if given.is_some() || files.is_empty() || files.len() < folders.len() {
        return Ok(default);
    }
    let models = files.iter().map(|file| model_for(Some(file), datasets)).collect::<Result<Vec<Model>, _>>()?;
    if models.iter().any(|model| *model != models[0]) {
        note("The runs of these data have models of their own: the default one is used; name another with --model.");
        return Ok(default);
    }
    if models[0] != default {
        note(&format!("The model is that of the run, {}; another is named with --model.", files[0].display()));
    }
    Ok(models.into_iter().next().unwrap_or(default))
}

/// The model file of the run to which a dataset belongs.
fn model_of_run(dataset: &Path) -> Option<PathBuf> {
    let run = match dataset.file_name() {
        Some(_) => dataset.parent()?.to_owned(),
        None => dataset.join(".."),
    };
    let file = run.join(MODEL);
    (run.join(Run::FILE).is_file() && file.is_file()).then_some(file)
}

/// Reads datasets and names them by their folders: the last component of the path, or as many as make the names unique.
pub fn read_datasets(folders: &[PathBuf]) -> Result<Vec<(String, Dataset)>, Failure> {
    // `.` and `D/` are named after the folders they denote.
    let whole: Vec<PathBuf> = folders.iter().map(|f| f.canonicalize().unwrap_or_else(|_| f.clone())).collect();
    let parts = |folder: &Path| folder.iter().map(|part| part.to_string_lossy().into_owned()).collect::<Vec<String>>();
    let end = |folder: &Path, length: usize| {
        let parts = parts(folder);
        parts[parts.len().saturating_sub(length)..].join("/")
    };
    let distinct = |length: &usize| {
        let names: Vec<String> = whole.iter().map(|f| end(f, *length)).collect();
        (1..names.len()).all(|k| whole[..k].contains(&whole[k]) || !names[..k].contains(&names[k]))
    };
    let longest = whole.iter().map(|f| f.iter().count()).max().unwrap_or(1);
    let length = (1..=longest).find(distinct).unwrap_or(longest);
    let mut datasets: Vec<(String, Dataset)> = Vec::with_capacity(folders.len());
    for (folder, whole) in folders.iter().zip(&whole) {
        let dataset = read_dataset(folder)?;
        // A copy would count the same measurements twice.
        if let Some((first, _)) = datasets.iter().find(|(_, d)| d.hash == dataset.hash) {
            note(&format!("{} holds the same data as {first}; they are counted once.", folder.display()));
            continue;
        }
        datasets.push((end(whole, length), dataset));
    }
    Ok(datasets)
}

/// The reference of a robot, for a map that may be anywhere: a file by its whole path; a built-in robot needs none.
pub fn from_anywhere(named: &str) -> String {
    let RobotReference { name, .. } = RobotReference::parse(named);
    match Path::new(name).canonicalize() {
        Ok(absolute) if !BUILT_IN.contains(&name) => named.replacen(name, &absolute.to_string_lossy(), 1),
        _ => named.to_owned(),
    }
}

/// Reads a fleet of the robot of the data.
pub fn read_fleet_of(path: &Path, datasets: &[(String, Dataset)]) -> Result<Fleet, Failure> {
    let fleet = read_fleet(path)?;
    let robot = &datasets[0].1.robot;
    if !fleet.is_of(robot) {
        let (field, problem) = if fleet.robot == robot.name {
            (
                "geometry_sha256",
                format!("is of another nominal geometry than '{}' of the data; give a fleet of that one", robot.name),
            )
        } else {
            ("robot", format!("is of the type '{}', the data are of '{}'; give a fleet of that type", fleet.robot, robot.name))
        };
        return Err(Box::new(LocatedError { path: path.to_owned(), field, problem }));
    }
    Ok(fleet)
}

/// A model with what a fleet says, unless the robot is not like it.
pub fn with_fleet(
    model: Model,
    fleet: Option<&Path>,
    datasets: &[(String, Dataset)],
) -> Result<(Model, Option<FleetJudged>), Failure> {
    let Some(path) = fleet else { return Ok((model, None)) };
    let fleet = read_fleet_of(path, datasets)?;
    let (_, judged) = identify_with_fleet(&named(datasets), &model, &fleet)?;
    let used = judged.used == PriorUsed::Fleet;
    let prior = used.then(|| Arc::new(FleetPrior { noise: judged.noise, ..FleetPrior::of(&fleet) }));
    Ok((Model { fleet: prior, ..model }, Some(judged)))
}

/// Reads campaigns of the same arm that are judged but not fitted; one that is also fitted is dropped, and one that consists
/// mostly of fitted rows under another name is refused.
pub fn check_datasets(folders: &[PathBuf], fitted: &[(String, Dataset)]) -> Result<Vec<(String, Dataset)>, Failure> {
    let mut checks = read_datasets(folders)?;
    let first = &fitted[0].1;
    if let Some((name, other)) = checks.iter().find(|(_, d)| !d.robot.is_same_arm(&first.robot)) {
        let problem = format!(
            "is of '{}', the data are of '{}'; check against campaigns of the same robot",
            other.robot.name, first.robot.name
        );
        let folder = folders.iter().find(|f| f.ends_with(name)).unwrap_or(&folders[0]);
        return Err(Box::new(LocatedError { path: folder.join("dataset.toml"), field: "robot", problem }));
    }
    checks.retain(|(name, check)| {
        // Rows of set `validation` are judged, not fitted.
        let is_fitted =
            check.samples.iter().all(|s| s.set == SampleSet::Fit) && fitted.iter().any(|(_, d)| d.hash == check.hash);
        if is_fitted {
            note(&format!("{name} is among the data that are fitted; it cannot serve as a check, and is left out."));
        }
        !is_fitted
    });
    for (name, check) in &checks {
        let is_judged_by_set = check.samples.iter().any(|s| s.set == SampleSet::Validation);
        let judged = check.samples.iter().filter(|s| !is_judged_by_set || s.set == SampleSet::Validation);
        let of_the_fit = fitted.iter().flat_map(|(_, d)| d.samples.iter().filter(|s| s.set == SampleSet::Fit));
        if are_copied(judged, of_the_fit) {
            let folder = folders.iter().find(|f| f.ends_with(name)).unwrap_or(&folders[0]);
            let problem = "most of them are also fitted, and cannot serve as a check; check against rows that were left out";
            return Err(Box::new(LocatedError { path: folder.join("samples.csv"), field: "rows", problem: problem.into() }));
        }
    }
    Ok(checks)
}

/// The expected error of an examined fit at `poses`, or the reason why it cannot be predicted.
pub fn forecast(
    named: &[NamedDataset<'_>],
    examination: &Examination,
    poses: &WorkspacePoses,
) -> Result<Result<Forecast, NoForecast>, IdentifyError> {
    let Some(error) = WorkspaceError::predict(named, examination, poses)? else {
        return Ok(Err(NoForecast::of(&undetermined(examination))));
    };
    let ranges = examination.problem().joint_ranges();
    let extrapolation =
        Extrapolation::of(examination.problem().robot(), &ranges, examination.model(), poses.q.iter().map(Vec::as_slice));
    Ok(Ok(Forecast { error, extrapolation }))
}

/// Reads a calibration; warns on standard error if its fit did not converge.
pub fn read_calibration_to_use(path: &Path) -> Result<Calibration, Failure> {
    let calibration = read_calibration(path, Registry::catalogue())?;
    if let Some(misfit) = &calibration.misfit {
        warn(&format!("warning: {}: was identified by force. {misfit}", path.display()));
    }
    if let Some(outcome) = calibration.unconverged() {
        warn(&format!("warning: {}: the fit {}: do not use this calibration", path.display(), outcome.in_words()));
    }
    Ok(calibration)
}

/// Warns on standard error of poses of a prediction beyond the joint ranges of a calibration, and returns them.
pub fn warn_of_poses(calibration: &Calibration, poses: &WorkspacePoses) -> Extrapolation {
    let beyond =
        Extrapolation::of(&calibration.robot, &calibration.joint_ranges, &calibration.model, poses.q.iter().map(Vec::as_slice));
    if let Some(warning) = extrapolation_sentence(&beyond) {
        warn(&warning);
    }
    beyond
}

/// Prints the iterations and the size of a fit, with `-v`.
pub fn tell_fit(calibration: &Calibration) {
    print_detail(format!(
        "fit: {} Gauss-Newton steps, {}; {} parameters from {} samples",
        calibration.iterations,
        calibration.outcome.map_or("outcome not stated", Outcome::name),
        calibration.rank,
        calibration.samples
    ));
}

/// Borrows the datasets in the form that the library expects.
pub fn named(datasets: &[(String, Dataset)]) -> Vec<NamedDataset<'_>> {
    datasets.iter().map(|(n, d)| NamedDataset::new(n.as_str(), d)).collect()
}
