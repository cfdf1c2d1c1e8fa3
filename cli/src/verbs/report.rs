//! `report RUN` and `report DATASET...`: one HTML file.

use std::path::{Path, PathBuf};

use calibench::effects::registry::Registry;
use calibench::files::disk::write_whole;
use calibench::identify::Model;
use calibench::identify::calibration::{IdentifyError, read_calibration};
use calibench::identify::problem::Use;
use calibench::measure::dataset::file::read_dataset;
use calibench_report::documents::{self, Run};
use calibench_report::{AgainstError, CampaignRecord, CellPicture, Page, PageSubject, Recommended, page_html};
use calibench_workbench::Case;

use crate::arguments::data::{MODEL, locate_in_data, model_for, model_of, read_datasets};
use crate::arguments::data_gate::gate;
use crate::terminal::failure::{Failure, LocatedError, Outcome};
use crate::terminal::output::{check_outputs, print_answer, print_json};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::{input, output};

/// Default file name of a report.
pub const FILE: &str = "report.html";

#[derive(clap::Args)]
pub struct Arguments {
    /// Folder of a run (`run --out`), or dataset folders of one robot
    #[arg(required = true, value_name = "RUN|DATASET")]
    folders: Vec<PathBuf>,
    /// Model file, for datasets; the default is the paper's model: base_frame, mdh, joint_compliance. A run has its own
    #[arg(long, value_parser = input())]
    model: Option<PathBuf>,
    /// A second model file, on the same data: both side by side, and which predicts rows better that neither was fitted to
    #[arg(long, value_name = "MODEL")]
    against: Option<PathBuf>,
    /// Output file for the page; the default is report.html, in the folder of the run
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Run the whole ladder instead of the next step alone; takes seconds
    #[arg(long)]
    ladder: bool,
    /// Continue with data that do not fit the robot; the page says so
    #[arg(long)]
    force: bool,
    /// Print the document of the page instead of writing the page
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
    let case = open(&arguments.folders, model, arguments.force, arguments.json)?;
    let waiting = Waiting::new("diagnosing");
    let page = match &arguments.against {
        Some(other) => page_against(&case, arguments, other)?,
        None => page(&case, &arguments.folders, model, arguments.ladder)?,
    };
    drop(waiting);
    if arguments.json {
        print_json(&page.document)?;
        return Ok(Outcome::Done);
    }
    write_whole(&path, page_html(&page.document).as_bytes())?;
    let say = |key: &str| page.document["verdict"][key].as_str().unwrap_or_default().to_owned();
    case.misfits.iter().try_for_each(|(_, sentence)| print_answer(sentence))?;
    print_answer(format!("{}. {}", say("headline"), say("means")))?;
    page.document["against"]["sentence"].as_str().map_or(Ok(()), print_answer)?;
    print_answer(format!("Written to {}", path.display()))?;
    Ok(Outcome::Done)
}

/// Writes the report of a calibrated dataset into its folder: its model, with the judgement of the ladder that recommends it.
pub(super) fn write_report(folder: &PathBuf, model: &Path, judgement: &documents::Judged) -> Result<(), Failure> {
    let folders = std::slice::from_ref(folder);
    let case = open(folders, Some(model), true, false)?;
    let page = case
        .subject(&[0], &case.model, &case.commands, |s| Page::new(&PageSubject { judgement: Some(judgement), ..s.clone() }));
    let page = page.map_err(|e| locate_in_case(&case, folders, Some(model), &e))?;
    Ok(write_whole(&folder.join(FILE), page_html(&page.document).as_bytes())?)
}

/// Writes the report of a run into its folder, even if its data do not fit: they were used for the identification, and the page
/// says so.
pub fn write_report_of(run: &Path) -> Result<(), Failure> {
    let page = page(&passed(open_run(run)?, true, false)?, &[run.to_owned()], None, false)?;
    Ok(write_whole(&run.join(FILE), page_html(&page.document).as_bytes())?)
}

fn page(case: &Case, folders: &[PathBuf], model: Option<&Path>, whole_ladder: bool) -> Result<Page, Failure> {
    let all: Vec<usize> = (0..case.datasets.len()).collect();
    let page = case.subject(&all, &case.model, &case.commands, |s| Page::new(&PageSubject { whole_ladder, ..s.clone() }));
    page.map_err(|e| locate_in_case(case, folders, model, &e).into())
}

/// The page with the model `other` beside its own.
fn page_against(case: &Case, arguments: &Arguments, other: &Path) -> Result<Page, Failure> {
    let model = arguments.model.as_deref();
    let second = model_for(Some(other), &case.datasets)?;
    let own = if run_folder(&arguments.folders).is_some() { "the model of the run" } else { "the default model" };
    let (first_name, second_name) = told_apart(model, other);
    let names = [first_name.as_deref().unwrap_or(own), second_name.as_str()];
    let all: Vec<usize> = (0..case.datasets.len()).collect();
    let page = case.subject(&all, &case.model, &case.commands, |s| {
        Page::against(&PageSubject { whole_ladder: arguments.ladder, ..s.clone() }, &second, names)
    });
    page.map_err(|e| match e {
        AgainstError::First(e) => locate_in_case(case, &arguments.folders, model, &e).into(),
        AgainstError::Second(e) => locate_in_data(&data_folders(&arguments.folders), &case.datasets, Some(other), &e).into(),
        other => format!("{other:?}").into(),
    })
}

/// The names of two model files: those of the files or, if they are alike, their paths.
fn told_apart(first: Option<&Path>, second: &Path) -> (Option<String>, String) {
    let name = |p: &Path| p.file_name().map_or_else(|| p.display().to_string(), |n| n.to_string_lossy().into_owned());
    match first {
        Some(first) if name(first) == name(second) => (Some(first.display().to_string()), second.display().to_string()),
        _ => (first.map(name), name(second)),
    }
}

/// The folders of the data: of a run, that of its TriCal dataset.
fn data_folders(folders: &[PathBuf]) -> Vec<PathBuf> {
    run_folder(folders).map_or_else(|| folders.to_vec(), |run| vec![run.join("trical")])
}

/// Attributes an identification error to the opened folder or to the model.
pub(super) fn locate_in_case(case: &Case, folders: &[PathBuf], model: Option<&Path>, error: &IdentifyError) -> LocatedError {
    match run_folder(folders) {
        Some(run) => locate_in_data(&[run.join("trical")], &[], None, error),
        None => locate_in_data(folders, &case.datasets, model, error),
    }
}

/// The run folder, if `folders` is a single one that holds a run.
pub(super) fn run_folder(folders: &[PathBuf]) -> Option<&Path> {
    folders.first().map(PathBuf::as_path).filter(|f| folders.len() == 1 && f.join(Run::FILE).is_file())
}

/// Reads a run or datasets; the data must fit their robot unless `force`.
pub(super) fn open(folders: &[PathBuf], model: Option<&Path>, force: bool, json: bool) -> Result<Case, Failure> {
    let case = match run_folder(folders) {
        Some(_) if model.is_some() => {
            let problem = "--model is for datasets: a run is reported with the model that it was calibrated with; name its dataset instead";
            return Err(problem.into());
        }
        Some(run) => open_run(run),
        None => open_datasets(folders, model),
    };
    passed(case?, force, json)
}

/// Passes the opened data through the gate, keeping their misfits.
fn passed(case: Case, force: bool, json: bool) -> Result<Case, Failure> {
    let misfits = gate(&case.datasets, Use::Fit, force, json)?.misfits();
    Ok(Case { misfits, ..case })
}

/// Reads the TriCal data of a run, judged on its validation poses, from files alone.
fn open_run(run: &Path) -> Result<Case, Failure> {
    let result = Run::read(run)?;
    let [dataset, validation] = [read_dataset(&run.join("trical"))?, read_dataset(&run.join("validation"))?];
    let calibration = read_calibration(&run.join("trical.toml"), Registry::catalogue())?;
    // Other verbs use the default model without a file.
    let ordinary = calibration.model == Model::default_for(&dataset);
    Ok(Case {
        title: result.scenario.clone(),
        question: Some(result.question.clone()),
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
        run: Some(result),
        worker: None,
    })
}

fn open_datasets(folders: &[PathBuf], model: Option<&Path>) -> Result<Case, Failure> {
    let datasets = read_datasets(folders)?;
    let of_run = model_of(model, folders, &datasets)?;
    Ok(Case { model: of_run, ..Case::of_datasets(folders, datasets, model)? })
}
