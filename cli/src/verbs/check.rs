//! `keep check CALIBRATION --then CAMPAIGN [DATASET]`: whether a calibration still holds, by a few poses measured again.

use std::path::{Path, PathBuf};

use calibench::files::disk::{check_output_folder, write_whole};
use calibench::files::with_reasons;
use calibench::identify::calibration::Calibration;
use calibench::measure::campaign::cell::read_cell;
use calibench::measure::dataset::file::DATASET_TOML;
use calibench::measure::dataset::{Dataset, NamedDataset, Sample};
use calibench::measure::poses::{PlannedPose, read_plan, write_plan};
use calibench::monitoring::check::power::power_of_check;
use calibench::monitoring::check::{CheckError, CheckReference, choose_sentinels};
use calibench::monitoring::history::{History, HistoryError, HistoryLock, day_until_now};
use calibench::units::DEG;
use calibench_report::{charts_page, charts_text, check_plan_text, check_text, documents};

use super::measure::cell as measure_cell;
use super::measure::{Simulated, simulate};
use super::plan::cell::is_cell;
use crate::arguments::choices::seed;
use crate::arguments::choosing::Choice;
use crate::arguments::data::{read_calibration_to_use, read_datasets};
use crate::arguments::scenario::read_scenario;
use crate::terminal::failure::{Failure, LocatedError, Outcome};
use crate::terminal::output::{check_outputs, note, print, print_answer, print_json};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::{input, output};

/// Sizes for which the power of a check is printed, in units of the noise of one comparison.
const SIZES: [f64; 4] = [1.0, 2.0, 3.0, 5.0];

/// Largest difference between the joints at which the true arm reaches a ball and the planned ones, rad.
const ARM_ERRORS: f64 = 5.0 * DEG;

/// Three forms of call.
const USAGE: &str = "calibench keep check <CALIBRATION> <DATASET> --then <CAMPAIGN> [--history <FILE> --on <DAY>]
       calibench keep check <CALIBRATION> --then <CAMPAIGN> [--sentinels <N>] [--plan <PLAN> -o <SENTINELS>]
       calibench keep check <CALIBRATION> --then <CAMPAIGN> --cell <CELL|SCENARIO> --plan <SENTINELS> -o <DATASET>";

#[derive(clap::Args)]
#[command(override_usage = USAGE)]
pub struct Arguments {
    /// Calibration file written by `identify`
    calibration: PathBuf,
    /// Dataset folder of the check: some poses of the campaign, measured again; without it the check is planned
    #[arg(conflicts_with = "cell")]
    dataset: Option<PathBuf>,
    /// Dataset folder of the campaign that was calibrated, or of an earlier check: what the new measurements are compared with
    #[arg(long, value_name = "CAMPAIGN")]
    then: PathBuf,
    /// Number of poses to choose, if the check is planned
    #[arg(long, default_value_t = 5, conflicts_with_all = ["dataset", "cell"], value_parser = clap::value_parser!(u16).range(1..=100))]
    sentinels: u16,
    /// The plan by which the campaign was measured, of which the chosen poses are written to `-o`; with `--cell` the poses to
    /// probe
    #[arg(long, conflicts_with = "dataset", value_parser = input())]
    plan: Option<PathBuf>,
    /// Output: the plan of the chosen poses; with `--cell` the dataset
    #[arg(short, long, visible_alias = "out", requires = "plan", value_parser = output())]
    output: Option<PathBuf>,
    /// Visit to a simulated cell: 1 is the first after the campaign
    #[arg(long, value_name = "N", default_value_t = 1, requires = "cell")]
    visit: u64,
    /// Seed with which a simulated cell was measured, if not the scenario's
    #[arg(long, requires = "cell", value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Resume an interrupted check from its journal
    #[arg(long, requires = "cell")]
    resume: bool,
    #[command(flatten)]
    real: measure_cell::CellArguments,
    /// History file of the robot, to which the check is added; its control charts are printed
    #[arg(long, value_name = "FILE", requires = "on")]
    history: Option<PathBuf>,
    /// Day of the check, YYYY-MM-DD, for the history
    #[arg(long, value_name = "DAY", requires = "history", value_parser = day_until_now)]
    on: Option<String>,
    /// Write the control charts as an HTML page
    #[arg(long, value_name = "PAGE", requires = "history")]
    page: Option<PathBuf>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(&arguments.page)?;
    let calibration = read_calibration_to_use(&arguments.calibration)?;
    let (name, campaign) = read(&arguments.then)?;
    let then = NamedDataset::new(name.as_str(), &campaign);
    let reference = CheckReference::new(&calibration, then).map_err(|e| located(&arguments.then, &e))?;
    if !reference.is_as_calibrated() {
        note("The campaign is not the one that was calibrated: the verdict refers to the time since the campaign.");
    }
    if let Some(folder) = &arguments.dataset {
        return judge(arguments, &reference, &calibration.robot.name, folder);
    }
    let Some(cell) = &arguments.real.cell else { return plan(arguments, &calibration, then) };
    let (Some(plan), Some(folder)) = (&arguments.plan, &arguments.output) else {
        return Err("say where to write the dataset: -o DATASET".into());
    };
    if let Some(path) = &arguments.history {
        // A history of another calibration is refused before anything moves.
        History::read(path, &arguments.calibration, &arguments.then, &reference.digests())?;
    }
    match probe(arguments, &reference, cell, plan, folder)? {
        Outcome::Done if folder.join(DATASET_TOML).is_file() => judge(arguments, &reference, &calibration.robot.name, folder),
        outcome => Ok(outcome),
    }
}

fn read(folder: &PathBuf) -> Result<(String, Dataset), Failure> {
    let mut datasets = read_datasets(std::slice::from_ref(folder))?;
    Ok(datasets.remove(0))
}

/// Chooses the poses to measure again, and reports what they would find.
/// Writes these poses of the plan of a campaign, with their ways.
pub fn write_poses_of(plan: &Path, ids: &[String], campaign: &Dataset, output: &Path) -> Result<(), Failure> {
    let poses = read_plan(plan, campaign)?.of_poses(ids).map_err(|id| LocatedError {
        path: plan.to_owned(),
        field: "pose",
        problem: format!("has no pose '{id}', which the campaign has; name the plan by which the campaign was measured"),
    })?;
    Ok(write_plan(output, &poses, campaign)?)
}

fn plan(arguments: &Arguments, calibration: &Calibration, then: NamedDataset<'_>) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    let waiting = Waiting::new("planning the check");
    let located = |e: CheckError| located(&arguments.then, &e);
    let chosen = choose_sentinels(calibration, then, usize::from(arguments.sentinels)).map_err(located)?;
    let power = power_of_check(calibration, then, &chosen, &SIZES).map_err(located)?;
    drop(waiting);
    let ids: Vec<String> = chosen.iter().map(|&k| then.dataset.samples[k].id.clone()).collect();
    if let (Some(plan), Some(output)) = (&arguments.plan, &arguments.output) {
        write_poses_of(plan, &ids, then.dataset, output)?;
    }
    if arguments.json {
        print_json(&documents::Check::of_plan(ids, &power))?;
    } else {
        print(check_plan_text(&ids, &power))?;
        if let Some(path) = &arguments.output {
            print(format!("The plan is in {}.", path.display()))?;
        }
    }
    Ok(Outcome::Done)
}

/// Probes one pose after the other until a change is named, or all are probed.
fn probe(
    arguments: &Arguments,
    reference: &CheckReference<'_>,
    cell: &Path,
    plan: &Path,
    folder: &Path,
) -> Result<Outcome, Failure> {
    let then = reference.campaign();
    let is_real = is_cell(cell);
    let nominal = if is_real {
        read_cell(cell)?.dataset
    } else {
        let scenario = read_scenario(cell)?;
        scenario.expect_trical("keep check")?;
        Dataset { contact_force: scenario.indicators.contact_force(), ..scenario.dataset() }
    };
    expect_unmeasured(folder)?;
    let sentinels = read_plan(plan, &nominal)?;
    let now = |samples: Vec<Sample>| Dataset { samples, ..nominal.clone() };
    // What cannot be compared is refused before anything moves.
    let planned = sentinels.poses.iter().filter(|p| !p.reserve).filter_map(|pose| expected(pose, then.dataset));
    reference.noise(NamedDataset::new(then.name, &now(planned.collect()))).map_err(|e| LocatedError {
        path: plan.to_owned(),
        field: "pose",
        problem: with_reasons(&e),
    })?;
    let mut choose = |_: &[&PlannedPose], samples: &[Sample]| -> Option<usize> {
        let check = reference.check(NamedDataset::new(then.name, &now(samples.to_vec())));
        if check.is_ok_and(|check| check.settled) { None } else { Some(0) }
    };
    let under =
        vec![("check.calibration", arguments.calibration.display().to_string()), ("check.then", then.dataset.hash.clone())];
    let choice = Choice { choose: Some(&mut choose), silent: arguments.json, under };
    let Arguments { seed, visit, resume, .. } = *arguments;
    let simulated = Simulated { scenario: cell, plan: Some(plan), output: folder, seed, plant: None, visit, resume };
    measure_on(&simulated, plan, &arguments.real, choice)
}

/// Measures a plan on a cell, which is real if its file says so.
pub fn measure_on(
    cell: &Simulated<'_>,
    plan: &Path,
    real: &measure_cell::CellArguments,
    choice: Choice<'_>,
) -> Result<Outcome, Failure> {
    if is_cell(cell.scenario) {
        measure_cell::run(cell.scenario, real, plan, Some(cell.output), cell.resume, choice)
    } else {
        simulate(cell, choice)
    }
}

/// Refuses a folder in which something was measured already: it says nothing of today.
pub fn expect_unmeasured(folder: &Path) -> Result<(), Failure> {
    check_output_folder(folder, "dataset", DATASET_TOML)?;
    if folder.join(DATASET_TOML).is_file() {
        return Err(Box::new(LocatedError {
            path: folder.join(DATASET_TOML),
            field: "samples",
            problem:
                "was measured already, and nothing has moved; name a folder that is not there, or judge this one without --cell"
                    .into(),
        }));
    }
    Ok(())
}

/// The sample that a pose will give: at the joints of its sample in the campaign, where the true arm had the ball, if these are
/// the pose's own but for the errors of an arm.
fn expected(pose: &PlannedPose, campaign: &Dataset) -> Option<Sample> {
    let near = |s: &&Sample| s.q.iter().zip(&pose.contact).all(|(q, planned)| (q - planned).abs() <= ARM_ERRORS);
    let before = campaign.samples.iter().filter(|s| s.id == pose.id).find(near);
    let nominal = pose.nominal_sample()?;
    Some(before.map_or(nominal.clone(), |before| Sample { q: before.q.clone(), ..nominal }))
}

/// Judges measured poses, and adds them to the history.
fn judge(arguments: &Arguments, reference: &CheckReference<'_>, robot: &str, folder: &PathBuf) -> Result<Outcome, Failure> {
    let (_, now) = read(folder)?;
    // Both are of the calibration's set-up, whatever their folders are called.
    let (check, shown) =
        reference.check_with_power(NamedDataset::new(reference.campaign().name, &now)).map_err(|e| located(folder, &e))?;
    let mut charts = None;
    if let (Some(path), Some(on)) = (&arguments.history, &arguments.on) {
        // Another check must not be added between reading and writing.
        let mut told = || note(&format!("{}: another check is being added; this one waits.", path.display()));
        let _lock = HistoryLock::acquire(path, &mut told)?;
        let mut history = History::read(path, &arguments.calibration, &arguments.then, &reference.digests())?;
        history.add(path, on, folder, &check).map_err(|e| match e {
            HistoryError::Older { .. } => format!("--on {e}"),
            e => e.to_string(),
        })?;
        let drawn = history.charts(path, reference, &now)?.map_err(|e| located(folder, &e))?;
        let days: Vec<String> = history.check.iter().map(|entry| entry.on.clone()).collect();
        if let Some(page) = &arguments.page {
            write_whole(page, charts_page(robot, &days, &history.verdicts(), &drawn).as_bytes())?;
        }
        history.write(path)?;
        charts = Some((days, drawn));
    }
    if arguments.json {
        let mut document = documents::Check::of(&check, &shown);
        if let Some((days, charts)) = &charts {
            document = document.with_charts(days, charts);
        }
        print_json(&document)?;
    } else {
        print_answer(check_text(&check, &shown))?;
        if let Some((days, charts)) = &charts {
            print(charts_text(days, charts))?;
        }
    }
    let drifts = charts.is_some_and(|(_, charts)| !charts.signals().is_empty());
    Ok(if check.changed || drifts { Outcome::ExpectationFailed } else { Outcome::Done })
}

fn located(folder: &Path, error: &CheckError) -> Failure {
    let (file, field, remedy) = match error {
        CheckError::NoCounterpart { .. } => {
            ("samples.csv", "id", "; leave it out, or name the campaign in which it was measured with --then")
        }
        CheckError::NoNoise => ("dataset.toml", "noise", "; state it in [noise], or as sigma_um of the rows"),
        CheckError::OtherSetUp => (
            "dataset.toml",
            "base",
            "; give those of the campaign: what is imported takes them by `import --set-up-of CAMPAIGN`",
        ),
        CheckError::OtherLoads { field, .. } => {
            ("dataset.toml", *field, "; state that of the campaign, or correct the campaign's and calibrate again")
        }
        CheckError::SameRows { .. } => ("samples.csv", "rows", "; leave the copy out"),
        CheckError::TooFewPoses { .. } => ("samples.csv", "rows", "; measure more poses of the campaign again"),
        CheckError::Foreign { .. } => ("samples.csv", "rows", "; name the campaign that was calibrated with --then"),
        CheckError::Itself => ("samples.csv", "rows", "; name the dataset of what was measured again"),
        CheckError::Nothing => ("samples.csv", "rows", "; measure some poses of the campaign again"),
        _ => ("samples.csv", "rows", ""),
    };
    Box::new(LocatedError { path: folder.join(file), field, problem: format!("{}{remedy}", with_reasons(error)) })
}
