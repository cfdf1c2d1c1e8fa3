//! `workbench DATASET...|RUN`: the report's page, live on the loopback address.

use std::io::Write;
use std::path::PathBuf;

use super::report::{blame_opened, open, run_folder};
use super::{Failure, Outcome};
use crate::workbench::{Bench, HEADER_PATIENCE, Place, Server};

#[derive(clap::Args)]
pub struct Arguments {
    /// The folder that `run --out` wrote; or dataset folders of one robot
    #[arg(required = true, value_name = "RUN|DATASET")]
    folders: Vec<PathBuf>,
    /// Model file to begin with, for datasets; the default is the paper's model: base_frame, mdh, joint_compliance. A run has its own
    #[arg(long)]
    model: Option<PathBuf>,
    /// Port on the loopback address; 0 takes a free one
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Folder for model.toml and report.html, made when one is saved; the default is the first dataset, or `workbench` in the run
    #[arg(long, value_name = "FOLDER")]
    save_to: Option<PathBuf>,
    /// Go on with data that do not fit the robot; the page says so
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let Arguments { folders, model, port, save_to, force } = arguments;
    let opened = open(folders, model.as_deref(), *force, false)?;
    // The first line on standard output is the address.
    opened.misfits.iter().for_each(|(_, sentence)| eprintln!("{sentence}"));
    let default = || match run_folder(folders) {
        // The model and the report of the run itself stay as they are.
        Some(run) => run.join("workbench"),
        None => folders[0].clone(),
    };
    let place = Place::new(save_to.clone().unwrap_or_else(default), model.clone());
    let bench = Bench::new(opened, place).map_err(|(opened, e)| blame_opened(&opened, folders, model.as_deref(), &e))?;
    let server = Server::new(bench, *port, HEADER_PATIENCE)
        .map_err(|e| format!("port {port} of the loopback address: {e}; name another with --port"))?;
    server.run(|url| {
        let mut out = std::io::stdout().lock();
        writeln!(out, "{url}").and_then(|()| out.flush())
    })?;
    Ok(Outcome::Done)
}
