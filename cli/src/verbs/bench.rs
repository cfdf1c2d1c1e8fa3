//! `bench --rival CMD -o DIR`: methods of calibration compared on the same divisions of public measurements.

mod page;
mod plan;
mod rival;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use calibench::files::disk::write_whole;
use calibench::identify::problem::Use;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset};
use calibench_lab::bench::{Entry, Judged, Prediction, bench_files, judge, standings};
use calibench_lab::prove::{Case, Proven, Row};
use serde_json::json;

use self::plan::{Plan, RobotEntry, read_plan};
use self::rival::{Rival, rival};
use super::prove::thin;
use crate::arguments::choices::seed;
use crate::arguments::data::{named, read_datasets};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print_answer, print_json};
use crate::terminal::progress::Waiting;

/// Names of the two methods of the program itself.
const DEFAULT: &str = "default";
const RECOMMENDED: &str = "recommended";

#[derive(clap::Args)]
pub struct Arguments {
    /// File of the robots and their divisions
    #[arg(default_value = "bench/robots.toml")]
    plan: PathBuf,
    /// Folder with the datasets that the file names; the default is `data` beside the file
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Command of a method, called with the folder of a division as its last argument; words are parted by spaces. Its name is
    /// that of its script unless stated before an equals sign; repeat for several
    #[arg(long = "rival", value_name = "[NAME=]CMD", value_parser = rival)]
    rivals: Vec<Rival>,
    /// Only this robot; repeat for several
    #[arg(long, value_name = "ROBOT")]
    only: Vec<String>,
    /// Longest time of a rival on one division, s
    #[arg(long, value_name = "SECONDS", default_value_t = 600, value_parser = clap::value_parser!(u64).range(1..))]
    limit: u64,
    /// Go on with a comparison in the output folder: a prediction that is there stays if the rows of its division are the same
    #[arg(long)]
    resume: bool,
    /// Seed of the random divisions and intervals
    #[arg(long, value_parser = seed, allow_negative_numbers = true, default_value_t = 1)]
    seed: u64,
    /// Output folder for the divisions, the predictions and the leaderboard; existing files are replaced
    #[arg(short, long, visible_alias = "out")]
    output: PathBuf,
    /// Print one JSON document instead of the page
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let Arguments { output, rivals, .. } = arguments;
    check_names(rivals)?;
    let plan = read_plan(&arguments.plan)?;
    if let Some(unknown) = arguments.only.iter().find(|name| plan.robot.iter().all(|robot| robot.name != **name)) {
        return Err(format!("--only {unknown}: is not a robot of {}", arguments.plan.display()).into());
    }
    let [csv, document, page] = ["leaderboard.csv", "leaderboard.json", "leaderboard.md"].map(|name| output.join(name));
    check_outputs([&csv, &document, &page])?;
    let waiting = Waiting::new("reading");
    let mut bench = Bench { arguments, waiting, entries: Vec::new(), folders: BTreeSet::new() };
    let (mut result, mut text) = (json!(null), String::new());
    for robot in chosen(&plan, &arguments.only) {
        bench.robot(robot)?;
        // After each robot, so that a run of hours that is stopped leaves what it has.
        let standings = standings(&bench.entries, arguments.seed);
        text = page::markdown(&standings, &bench.entries);
        result = json!({
            "format": "calibench-bench/1", "seed": arguments.seed, "standings": standings, "divisions": bench.entries,
        });
        write_whole(&csv, page::table(&bench.entries).as_bytes())?;
        write_whole(&document, format!("{result:#}\n").as_bytes())?;
        write_whole(&page, text.as_bytes())?;
    }
    let Bench { waiting, entries, .. } = bench;
    drop(waiting);
    if arguments.json {
        print_json(&result)?;
    } else {
        print_answer(text)?;
    }
    let failed = entries.iter().any(|entry| entry.fault.is_some());
    Ok(if failed { Outcome::ExpectationFailed } else { Outcome::Done })
}

/// Names become names of files, and of rows.
fn check_names(rivals: &[Rival]) -> Result<(), Failure> {
    let mut names = BTreeSet::from([DEFAULT, RECOMMENDED]);
    for Rival { name, .. } in rivals {
        if !names.insert(name) {
            return Err(format!("--rival {name}: there is a method of this name already; name it as --rival NAME=CMD").into());
        }
    }
    Ok(())
}

fn chosen<'a>(plan: &'a Plan, only: &'a [String]) -> impl Iterator<Item = &'a RobotEntry> {
    plan.robot.iter().filter(move |robot| only.is_empty() || only.contains(&robot.name))
}

/// The comparison, as far as it is done.
struct Bench<'a> {
    arguments: &'a Arguments,
    waiting: Waiting,
    entries: Vec<Entry>,
    /// Folders of the divisions so far.
    folders: BTreeSet<PathBuf>,
}

/// One division, ready for every method.
struct Setting<'a> {
    robot: &'a str,
    case: &'a Case<'a>,
    /// Folder of its files.
    folder: &'a Path,
    fitted: Vec<Row>,
    judged: Vec<Row>,
    /// Mean error of the default model, mm.
    default_mm: f64,
}

impl Bench<'_> {
    /// All divisions of one robot.
    fn robot(&mut self, robot: &RobotEntry) -> Result<(), Failure> {
        let beside = || self.arguments.plan.parent().unwrap_or(Path::new("")).join("data");
        let data = self.arguments.data.clone().unwrap_or_else(beside);
        let folders: Vec<PathBuf> = robot.data.iter().map(|name| data.join(name)).collect();
        let mut datasets = read_datasets(&folders)?;
        for (name, dataset) in &mut datasets {
            if dataset.samples.iter().any(|s| matches!(s.measured, Measured::Distance { .. })) {
                return Err(format!("{name}: holds distances; the benchmark takes positions and balls").into());
            }
            thin(dataset, robot.at_most.unwrap_or(usize::MAX), Use::All);
        }
        let named = named(&datasets);
        for case in robot.cases(&named, self.arguments.seed) {
            self.waiting.now(format!("{}, {}", case.robot, case.fold));
            match case.prove() {
                Ok(proven) => self.division(&robot.name, &case, &named, &proven)?,
                Err(e) => {
                    self.waiting.warn(&format!("{}, {}: is left out, the default model has no fit: {e}", case.robot, case.fold))
                }
            }
        }
        Ok(())
    }

    /// All methods on one division.
    fn division(&mut self, robot: &str, case: &Case<'_>, named: &[NamedDataset<'_>], proven: &Proven) -> Result<(), Failure> {
        let folder = self.free_folder(&case.file_name());
        let rows = case.rows(&proven.default)?;
        let (fitted, judged): (Vec<Row>, Vec<Row>) = rows.into_iter().partition(Row::is_fitted);
        let given: Vec<Row> = fitted.iter().cloned().chain(case.set_up_rows(&proven.default)?).collect();
        let dataset: &Dataset = named[0].dataset;
        let files = bench_files(dataset, &given, &judged);
        let mut same = true;
        for (name, content) in [("fitted.csv", files.fitted), ("judged.csv", files.judged), ("robot.json", files.robot)] {
            let path = folder.join(name);
            same &= fs::read(&path).is_ok_and(|earlier| earlier == content.as_bytes());
            write_whole(&path, content.as_bytes())?;
        }
        let keep = same && self.arguments.resume;
        let seed = self.arguments.seed;
        let judged_of = |rows: &[Row], expected: Option<f64>| {
            let said: Vec<Prediction> = rows.iter().map(|row| Prediction { position: row.predicted, expected: None }).collect();
            Judged { expected_over_measured: expected, ..judge(&fitted, rows, &said, seed) }
        };
        let [of_default, of_recommended] = proven.proof.predicted_over_measured;
        let by_default = judged_of(&judged, of_default);
        let recommended: Vec<Row> = case.rows(&proven.recommended)?.into_iter().filter(|row| !row.is_fitted()).collect();
        let by_recommended = judged_of(&recommended, of_recommended);
        let setting = Setting { robot, case, folder: &folder, default_mm: by_default.mean_mm, fitted, judged };
        self.entries.push(setting.entry(DEFAULT, Ok(by_default), case.seconds_of_default()?));
        self.entries.push(setting.entry(RECOMMENDED, Ok(by_recommended), proven.proof.seconds));
        for rival in &self.arguments.rivals {
            self.waiting.now(format!("{}, {}: {}", case.robot, case.fold, rival.name));
            let wanted = setting.judged.len();
            let earlier = if keep { rival.earlier(&folder, wanted) } else { None };
            let tried = match earlier {
                Some(earlier) => earlier,
                None => rival.on(&folder, wanted, self.arguments.limit)?,
            };
            let result = tried.predictions.map(|said| judge(&setting.fitted, &setting.judged, &said, seed));
            let entry = setting.entry(&rival.name, result.map_err(|fault| fault.to_string()), tried.seconds);
            if let Some(fault) = &entry.fault {
                self.waiting.warn(&format!("{}, {}: {fault}", rival.name, entry.division));
            }
            self.entries.push(entry);
        }
        Ok(())
    }

    /// A folder not yet used by another division.
    fn free_folder(&mut self, file: &str) -> PathBuf {
        let stem = file.trim_end_matches(".csv");
        let all = self.arguments.output.join("divisions");
        let names = std::iter::once(stem.to_owned()).chain((2..).map(|k| format!("{stem}-{k}")));
        let mut free = names.map(|name| all.join(name)).filter(|folder| !self.folders.contains(folder));
        let folder = free.next().unwrap_or(all);
        self.folders.insert(folder.clone());
        folder
    }
}

impl Setting<'_> {
    fn entry(&self, method: &str, result: Result<Judged, String>, seconds: f64) -> Entry {
        let (judged, fault) = match result {
            Ok(judged) => (Some(judged), None),
            Err(fault) => (None, Some(fault)),
        };
        Entry {
            method: method.to_owned(),
            robot: self.robot.to_owned(),
            division: self.folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            kind: self.case.division,
            ratio: judged.as_ref().map_or(1.0, |judged| judged.mean_mm / self.default_mm),
            judged,
            seconds,
            fault,
        }
    }
}
