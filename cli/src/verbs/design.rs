//! `sim design SCENARIO`: placement of the balls of an artifact.

use std::path::{Component, Path, PathBuf};

use calibench::files::disk::write_whole;
use serde_json::to_value;
use toml::{Table, Value};

use crate::arguments::choices::seed;
use crate::arguments::scenario::read_document;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print_answer, print_json};
use crate::terminal::progress::Steps;
use crate::terminal::streams::output;
use calibench_lab::design::{Design, Judged, design, design_page, design_text};

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file with a [design] table
    scenario: PathBuf,
    /// Output file for the scenario with the recommended artifact (TOML); it extends the given one
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Output file for a self-contained page (HTML): layout, map or front, and the numbers
    #[arg(long, value_name = "FILE", value_parser = output())]
    report: Option<PathBuf>,
    /// Number of trials on the simulated cell for each compared artifact; 0 for none
    #[arg(long, default_value_t = 100)]
    trials: u64,
    /// Seed that replaces the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(arguments.output.iter().chain(&arguments.report))?;
    let document = read_document(&arguments.scenario)?;
    let seed = arguments.seed.map_or_else(|| document.scenario().map(|s| s.seed), Ok)?;
    let bar = Steps::new();
    let found = design(&document, seed, arguments.trials, &bar)?;
    drop(bar);
    let document = to_value(&found)?;
    if let Some(path) = &arguments.output {
        write_whole(path, scenario_text(&found, &arguments.scenario, path)?.as_bytes())?;
    }
    if let Some(path) = &arguments.report {
        write_whole(path, design_page(&document).as_bytes())?;
    }
    if arguments.json {
        print_json(&document)?;
    } else {
        print_answer(design_text(&found))?;
    }
    Ok(Outcome::Done)
}

/// The scenario of the recommended artifact, for a file at `path` that extends the one at `of`.
fn scenario_text(found: &Design, of: &Path, path: &Path) -> Result<String, Failure> {
    let Judged { worst_um, mean_um, mass_kg, balls, .. } = &found.best;
    let document = found.best.document().ok_or("the artifact recommended has a scenario")?;
    let mut keys = Table::new();
    for key in ["ball", "solid"] {
        keys.extend(document.get(&key.parse()?).map(|value| (key.to_owned(), value.clone())));
    }
    let poses = document.get(&"plan.poses_per_ball".parse()?).cloned();
    keys.insert("plan".into(), Value::Table(poses.map(|p| ("poses_per_ball".to_owned(), p)).into_iter().collect()));
    let head = Table::from_iter([
        ("format".to_owned(), Value::String(calibench_sim::scenario::FORMAT.into())),
        ("extends".to_owned(), Value::String(beside(of, path))),
        ("name".to_owned(), Value::String(format!("{}-designed", found.name))),
        ("question".to_owned(), Value::String(format!("What does the artifact designed in {} give?", found.name))),
    ]);
    let said = format!(
        "# Designed by `calibench sim design`, seed {}: {} balls, one-sigma over the workspace {worst_um:.1} um at worst, {mean_um:.1} um on average; {mass_kg:.1} kg.\n",
        found.seed,
        balls.len()
    );
    Ok(format!("{said}{head}\n{keys}"))
}

/// The path of the file `of` relative to the folder of `path`.
fn beside(of: &Path, path: &Path) -> String {
    let full = |p: &Path| p.canonicalize().unwrap_or_else(|_| p.to_owned());
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).map_or_else(|| full(Path::new(".")), full);
    let of = full(of);
    let shared = of.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(of.components().skip(shared)).collect::<PathBuf>().to_string_lossy().into_owned()
}
