//! The program `calibench-view`.

use std::path::PathBuf;
use std::process::ExitCode;

use calibench::files::one_line;
use calibench_view::{RecordOptions, Subject, ViewError, record};
use clap::Parser;

/// Record a calibration for the rerun viewer
#[derive(Parser)]
#[command(name = "calibench-view", version)]
struct Arguments {
    /// Folder of a run (`calibench run --out`), or a dataset folder
    #[arg(value_name = "RUN|DATASET")]
    folder: PathBuf,
    /// Output file for the recording; the default is run.rrd, in the folder
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Factor by which the deviation of a model's arm is exaggerated; the default makes the difference visible
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    exaggerate: Option<f64>,
    /// Run the ladder of missing effects, and show the residuals before and after each step; takes seconds
    #[arg(long)]
    ladder: bool,
}

fn factor(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(factor) if factor.is_finite() && factor > 0.0 => Ok(factor),
        _ => Err("give a positive number".into()),
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match make(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("calibench-view: {error}");
            ExitCode::from(2)
        }
    }
}

fn make(arguments: &Arguments) -> Result<(), ViewError> {
    let subject = Subject::read(&arguments.folder)?;
    let output = arguments.output.clone().unwrap_or_else(|| arguments.folder.join("run.rrd"));
    record(&subject, &RecordOptions { exaggerate: arguments.exaggerate, ladder: arguments.ladder }, &output)?;
    if !subject.left_out.is_empty() {
        eprintln!("calibench-view: left out: {}", subject.left_out.join("; "));
    }
    println!("Written to {}", one_line(&output.display().to_string()));
    Ok(())
}
