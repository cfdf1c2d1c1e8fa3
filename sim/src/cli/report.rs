//! `report RUN` and `report DATASET...`: one HTML file.

use std::path::{Path, PathBuf};

use calibench::files::{FileError, read_text, write_whole};
use calibench::identify::{IdentifyError, Model, Use, read_calibration};
use calibench::measure::read_dataset;
use calibench::report::{CampaignRecord, CellPicture, Page, PageSubject, Recommended, page_html};
use serde_json::Value;

use super::progress::Waiting;
use super::{
    Blamed, Failure, Outcome, blame_data, check_outputs, gate, model_for, print, print_json, read_datasets, recommended,
};
use crate::opened::Opened;

/// What a report is called where nobody says otherwise.
pub const FILE: &str = "report.html";

/// The model with which a run was calibrated, in its folder.
pub const MODEL: &str = "model.toml";

/// What makes a folder a run.
const RESULT: &str = "result.json";

#[derive(clap::Args)]
pub struct Arguments {
    /// The folder that `run --out` wrote; or dataset folders of one robot
    #[arg(required = true, value_name = "RUN|DATASET")]
    folders: Vec<PathBuf>,
    /// Model file, for datasets; the default is the paper's model: base_frame, mdh, joint_compliance. A run has its own
    #[arg(long)]
    model: Option<PathBuf>,
    /// Where to write the page; the default is report.html, in the folder of the run
    #[arg(short, long, visible_alias = "out")]
    output: Option<PathBuf>,
    /// Climb the whole ladder, not only the next step; takes seconds
    #[arg(long)]
    ladder: bool,
    /// Go on with data that do not fit the robot; the page says so
    #[arg(long)]
    force: bool,
    /// Print the document of the page, and write no page
    #[arg(long, conflicts_with = "output")]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let default = || run_folder(&arguments.folders).map_or_else(|| PathBuf::from(FILE), |run| run.join(FILE));
    let path = arguments.output.clone().unwrap_or_else(default);
    if !arguments.json {
        check_outputs([&path])?;
    }
    let model = arguments.model.as_deref();
    let opened = open(&arguments.folders, model, arguments.force, arguments.json)?;
    let waiting = Waiting::new("diagnosing");
    let page = page(&opened, &arguments.folders, model, arguments.ladder)?;
    drop(waiting);
    if arguments.json {
        print_json(&page.document)?;
        return Ok(Outcome::Done);
    }
    write_whole(&path, page_html(&page.document).as_bytes())?;
    let say = |key: &str| page.document["verdict"][key].as_str().unwrap_or_default().to_owned();
    opened.misfits.iter().try_for_each(|(_, sentence)| print(sentence))?;
    print(&format!("{}. {}\nWritten to {}", say("headline"), say("means"), path.display()))?;
    Ok(Outcome::Done)
}

/// Writes the report of a run into its folder, also where its data do not fit: they were identified with, and the page says so.
pub fn write_report_of(run: &Path) -> Result<(), Failure> {
    let page = page(&passed(open_run(run)?, true, false)?, &[run.to_owned()], None, false)?;
    Ok(write_whole(&run.join(FILE), page_html(&page.document).as_bytes())?)
}

fn page(opened: &Opened, folders: &[PathBuf], model: Option<&Path>, climb: bool) -> Result<Page, Failure> {
    let all: Vec<usize> = (0..opened.datasets.len()).collect();
    let page = opened.subject(&all, &opened.model, &opened.commands, |s| Page::new(&PageSubject { climb, ..s.clone() }));
    page.map_err(|e| blame_opened(opened, folders, model, &e).into())
}

/// Puts the failure of an identification at the folder that was opened, or at the model.
pub(super) fn blame_opened(opened: &Opened, folders: &[PathBuf], model: Option<&Path>, error: &IdentifyError) -> Blamed {
    match run_folder(folders) {
        Some(run) => blame_data(&[run.join("trical")], &[], None, error),
        None => blame_data(folders, &opened.datasets, model, error),
    }
}

/// The run among what was named, if it is one.
pub(super) fn run_folder(folders: &[PathBuf]) -> Option<&Path> {
    folders.first().map(PathBuf::as_path).filter(|f| folders.len() == 1 && f.join(RESULT).is_file())
}

/// Reads a run, or datasets, which must fit their robot unless `force`.
pub(super) fn open(folders: &[PathBuf], model: Option<&Path>, force: bool, json: bool) -> Result<Opened, Failure> {
    let opened = match run_folder(folders) {
        Some(_) if model.is_some() => {
            let problem = "--model is for datasets: a run is reported with the model that it was calibrated with; name its dataset instead";
            return Err(problem.into());
        }
        Some(run) => open_run(run),
        None => open_datasets(folders, model),
    };
    passed(opened?, force, json)
}

/// What was opened, once its data have passed the gate or were let through.
fn passed(opened: Opened, force: bool, json: bool) -> Result<Opened, Failure> {
    let misfits = gate(&opened.datasets, Use::Fit, force, json)?.misfits();
    Ok(Opened { misfits, ..opened })
}

/// The TriCal's data of a run, judged on the run's validation poses; told from files alone.
fn open_run(run: &Path) -> Result<Opened, Failure> {
    let result = read_result(&run.join(RESULT))?;
    let [dataset, validation] = [read_dataset(&run.join("trical"))?, read_dataset(&run.join("validation"))?];
    let calibration = read_calibration(&run.join("trical.toml"))?;
    let text = |key: &str| result[key].as_str().map(str::to_owned);
    // What the other verbs take by themselves needs no file.
    let ordinary = calibration.model == Model::default_for(&dataset);
    Ok(Opened {
        title: text("scenario").unwrap_or_else(|| "run".into()),
        question: text("question"),
        misfits: Vec::new(),
        datasets: vec![("trical".into(), dataset)],
        judged: Some(("validation".into(), validation)),
        model: calibration.model,
        commands: Recommended {
            datasets: "trical".into(),
            model: if ordinary { String::new() } else { format!(" --model {MODEL}") },
        },
        commands_from: "the folder of the run".into(),
        campaign: CampaignRecord::read(run)?,
        pictures: CellPicture::read(run)?,
        run: result,
    })
}

fn open_datasets(folders: &[PathBuf], model: Option<&Path>) -> Result<Opened, Failure> {
    let datasets = read_datasets(folders)?;
    let names: Vec<&str> = datasets.iter().map(|(name, _)| name.as_str()).collect();
    Ok(Opened {
        title: names.join(", "),
        question: None,
        misfits: Vec::new(),
        model: model_for(model, &datasets)?,
        judged: None,
        commands: recommended(folders, model),
        commands_from: String::new(),
        campaign: None,
        pictures: Vec::new(),
        run: Value::Null,
        datasets,
    })
}

fn read_result(path: &Path) -> Result<Value, FileError> {
    let wrong = |problem: String| FileError::whole(path, problem, "give the file as `calibench run` wrote it");
    let value: Value = serde_json::from_str(&read_text(path)?).map_err(|e| wrong(format!("is no JSON: {e}")))?;
    if value["format"] != "calibench-run/1" {
        return Err(wrong(format!("has the format {}, not \"calibench-run/1\"", value["format"])));
    }
    Ok(value)
}
