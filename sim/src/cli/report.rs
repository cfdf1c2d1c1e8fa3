//! `report RUN` and `report DATASET...`: one HTML file.

use std::path::{Path, PathBuf};

use calibench::files::{FileError, read_text, write_whole};
use calibench::identify::{Model, read_calibration};
use calibench::measure::read_dataset;
use calibench::report::{CampaignRecord, Page, PageSubject, Recommended, page_html};
use serde_json::Value;

use super::progress::Waiting;
use super::{Failure, Outcome, blame_data, model_for, named, print, print_json, read_datasets, recommended};

/// What a report is called where nobody says otherwise.
pub const FILE: &str = "report.html";

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
    /// Print the document of the page, and write no page
    #[arg(long, conflicts_with = "output")]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let folder = arguments.folders.first().filter(|f| arguments.folders.len() == 1 && f.join(RESULT).is_file());
    let waiting = Waiting::new("diagnosing");
    let page = match folder {
        Some(_) if arguments.model.is_some() => {
            return Err("--model is for datasets: a run is reported with the model that it was calibrated with; name its dataset instead".into());
        }
        Some(run) => of_run(run, arguments.ladder)?,
        None => of_datasets(arguments)?,
    };
    drop(waiting);
    if arguments.json {
        print_json(&page.document)?;
        return Ok(Outcome::Done);
    }
    let default = || folder.map_or_else(|| PathBuf::from(FILE), |run| run.join(FILE));
    let path = arguments.output.clone().unwrap_or_else(default);
    write_whole(&path, page_html(&page.document).as_bytes())?;
    let say = |key: &str| page.document["verdict"][key].as_str().unwrap_or_default().to_owned();
    print(&format!("{}. {}\nWritten to {}", say("headline"), say("means"), path.display()))?;
    Ok(Outcome::Done)
}

/// Writes the report of a run into its folder.
pub fn write_report_of(run: &Path) -> Result<(), Failure> {
    let page = of_run(run, false)?;
    Ok(write_whole(&run.join(FILE), page_html(&page.document).as_bytes())?)
}

/// The TriCal's data of a run, judged on the run's validation poses; told from files alone.
fn of_run(run: &Path, climb: bool) -> Result<Page, Failure> {
    let result = read_result(&run.join(RESULT))?;
    let [dataset, validation] = [read_dataset(&run.join("trical"))?, read_dataset(&run.join("validation"))?];
    let calibration = read_calibration(&run.join("trical.toml"))?;
    let text = |key: &str| result[key].as_str().map(str::to_owned);
    // What the other verbs take by themselves needs no file.
    let ordinary = calibration.model == Model::default_for(&dataset);
    let [model, commands_from] = if ordinary {
        ["", "the folder of the run"]
    } else {
        [" --model MODEL.toml", "the folder of the run, with the model of the scenario in MODEL.toml"]
    };
    let subject = PageSubject {
        title: text("scenario").unwrap_or_else(|| "run".into()),
        question: text("question"),
        datasets: &[("trical", &dataset)],
        judged: &[("validation", &validation)],
        model: &calibration.model,
        commands: Recommended { datasets: "trical".into(), model: model.into() },
        commands_from: commands_from.into(),
        climb,
        campaign: CampaignRecord::read(run)?,
        run: result,
    };
    let path = run.join("trical");
    Page::new(&subject).map_err(|e| blame_data(&[path], &[], None, &e).into())
}

fn of_datasets(arguments: &Arguments) -> Result<Page, Failure> {
    let folders = &arguments.folders;
    let datasets = read_datasets(folders)?;
    let model = model_for(arguments.model.as_deref(), &datasets)?;
    let names: Vec<&str> = datasets.iter().map(|(name, _)| name.as_str()).collect();
    let subject = PageSubject {
        title: names.join(", "),
        question: None,
        datasets: &named(&datasets),
        judged: &named(&datasets),
        model: &model,
        commands: recommended(folders, arguments.model.as_deref()),
        commands_from: String::new(),
        climb: arguments.ladder,
        campaign: None,
        run: Value::Null,
    };
    Page::new(&subject).map_err(|e| blame_data(folders, &datasets, arguments.model.as_deref(), &e).into())
}

fn read_result(path: &Path) -> Result<Value, FileError> {
    let wrong = |problem: String| FileError::whole(path, problem, "give the file as `calibench run` wrote it");
    let value: Value = serde_json::from_str(&read_text(path)?).map_err(|e| wrong(format!("is no JSON: {e}")))?;
    if value["format"] != "calibench-run/1" {
        return Err(wrong(format!("has the format {}, not \"calibench-run/1\"", value["format"])));
    }
    Ok(value)
}
