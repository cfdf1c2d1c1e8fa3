//! `workbench DATASET...|RUN`: the report's page, live on the loopback address.

use std::io::Write;
use std::path::PathBuf;

use super::failure::{Failure, Outcome};
use super::output::warn;
use super::report::{locate_in_case, open, run_folder};
use crate::workbench::{HEADER_PATIENCE, Server};
use calibench_report::workbench::{Bench, Place};

#[derive(clap::Args)]
pub struct Arguments {
    /// Folder of a run (`run --out`), or dataset folders of one robot
    #[arg(required = true, value_name = "RUN|DATASET")]
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
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let Arguments { folders, model, port, save_to, force } = arguments;
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
    let server = Server::new(bench, *port, HEADER_PATIENCE)
        .map_err(|e| format!("port {port} of the loopback address: {e}; name another with --port"))?;
    server.run(|url| {
        let mut out = std::io::stdout().lock();
        writeln!(out, "{url}").and_then(|()| out.flush())
    })?;
    Ok(Outcome::Done)
}
