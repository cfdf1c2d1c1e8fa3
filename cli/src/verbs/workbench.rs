//! `workbench DATASET...|RUN`: the report's page, live on the loopback address.

use std::io::Write;
use std::path::{Path, PathBuf};

use calibench::files::disk::write_whole;
use calibench_workbench::{Bench, Place, page_in_browser};

use super::report::{locate_in_case, open, run_folder};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print_answer, warn};
use crate::workbench::Listening;

#[derive(clap::Args)]
pub struct Arguments {
    /// Folder of a run (`run --out`), or dataset folders of one robot
    #[arg(required_unless_present = "page", value_name = "RUN|DATASET")]
    folders: Vec<PathBuf>,
    /// Initial model file, for datasets; the default is the paper's model: base_frame, mdh, joint_compliance. A run has its own
    #[arg(long)]
    model: Option<PathBuf>,
    /// Port on the loopback address; 0 takes a free one
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Folder for model.toml and report.html, created on the first save; the default is the first dataset, or `workbench` in
    /// the run
    #[arg(long, value_name = "FOLDER")]
    save_to: Option<PathBuf>,
    /// Continue with data that do not fit the robot; the page says so
    #[arg(long)]
    force: bool,
    /// Write the workbench that needs no server as one page into this folder, and serve nothing: index.html
    #[arg(long = "static", value_name = "DIR", conflicts_with_all = ["folders", "model", "port", "save_to", "force"])]
    page: Option<PathBuf>,
    /// The program that is put into this page; the default is calibench.wasm.gz beside this program, where web/build puts it
    #[arg(long, value_name = "FILE", requires = "page")]
    module: Option<PathBuf>,
}

/// The module, beside the program.
const MODULE: &str = "calibench.wasm.gz";

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let Arguments { folders, model, port, save_to, force, page, module } = arguments;
    if let Some(folder) = page {
        return write_page(folder, module.as_deref());
    }
    let case = open(folders, model.as_deref(), *force, false)?;
    // The address must be the first line on standard output.
    case.misfits.iter().for_each(|(_, sentence)| warn(sentence));
    let default = || match run_folder(folders) {
        // The run's own model and report stay unchanged.
        Some(run) => run.join("workbench"),
        None => folders[0].clone(),
    };
    let place = Place::new(save_to.clone().unwrap_or_else(default), model.clone());
    let bench = Bench::new(case, place).map_err(|(case, e)| locate_in_case(&case, folders, model.as_deref(), &e))?;
    let server = Listening::new(bench, *port)
        .map_err(|e| format!("port {port} of the loopback address: {e}; name another with --port"))?;
    server.run(|url| {
        let mut out = std::io::stdout().lock();
        writeln!(out, "{url}").and_then(|()| out.flush())
    })?;
    Ok(Outcome::Done)
}

/// Writes the page that needs no server.
fn write_page(folder: &Path, module: Option<&Path>) -> Result<Outcome, Failure> {
    let beside = || std::env::current_exe().map(|program| program.with_file_name(MODULE)).unwrap_or_else(|_| MODULE.into());
    let page = page_in_browser(&module.map_or_else(beside, Path::to_owned))?;
    let path = folder.join("index.html");
    write_whole(&path, page.as_bytes())?;
    print_answer(format!("Written to {}; any browser opens it, and any web server can hand it out.", path.display()))?;
    Ok(Outcome::Done)
}
