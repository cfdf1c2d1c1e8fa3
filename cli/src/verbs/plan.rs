//! `plan SCENARIO|CELL -o PLAN`, `plan next DATASET... -o PLAN`.

pub(super) mod cell;

use std::path::{Path, PathBuf};

use calibench::diagnosis::detectability::Detectability;
use calibench::measure::poses::write_plan;
use calibench_report::{detectability_text, documents};
use clap::Subcommand;

use self::cell::{is_cell, scenario_of};
use super::next;
use crate::arguments::choices::seed;
use crate::arguments::scenario::read_scenario;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print, print_answer, print_json};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::output;
use calibench_sim::planning::{Chosen, nominal_samples, plan_within, shown};

#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Arguments {
    #[command(subcommand)]
    verb: Option<Plan>,
    /// Scenario file, or the cell.toml of a real cell that refers to one
    #[arg(value_name = "SCENARIO|CELL", required = true)]
    scenario: Option<PathBuf>,
    /// Output file for the plan (TOML); an existing file is replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Plan this number of poses in which an instrument measures points, in place of probings of balls
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(6..=1000))]
    points: Option<u16>,
    /// Seed that replaces the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Print one JSON document: the detectability of effects by the plan
    #[arg(long)]
    json: bool,
}

#[derive(Subcommand)]
enum Plan {
    /// Propose the extra measurements that best separate the rival effects or most reduce the predicted error
    Next(next::Arguments),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    match (&arguments.verb, &arguments.scenario) {
        (Some(Plan::Next(a)), _) => next::run(a),
        (None, Some(path)) => plan(arguments, path),
        (None, None) => Err("give a scenario or a cell".into()),
    }
}

/// Plans the probings of a scenario or a cell.
fn plan(arguments: &Arguments, path: &Path) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    if let Some(points) = arguments.points {
        return cell::plan_points_of(path, arguments, points.into());
    }
    let (scenario, dataset, guards) = if is_cell(path) {
        let (scenario, cell) = scenario_of(path)?;
        (scenario, cell.dataset, Some(cell.guards))
    } else {
        let scenario = read_scenario(path)?;
        scenario.expect_trical("plan")?;
        let dataset = scenario.dataset();
        (scenario, dataset, None)
    };
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let waiting = Waiting::new("planning");
    let plan = plan_within(&scenario, seed, guards.as_ref()).map_err(|e| scenario.locate_plan(&e))?;
    drop(waiting);
    if let Some(path) = &arguments.output {
        write_plan(path, &plan.probing, &dataset)?;
    }
    let drawn = nominal_samples(&scenario, &plan.probing.poses, seed);
    let detectability = Detectability::of_plan(&drawn, &shown(&scenario.model, &drawn))?;
    if arguments.json {
        print_json(&documents::Detectability::of(&detectability))?;
        return Ok(Outcome::Done);
    }
    print_answer(chosen_sentence("probings", plan.wanted(), &plan.chosen))?;
    print(detectability_text(&detectability))?;
    if let Some(path) = &arguments.output {
        print(format!("The plan is in {}.", path.display()))?;
    }
    Ok(Outcome::Done)
}

/// Describes the choice of poses in words.
pub fn chosen_sentence(what: &str, count: usize, chosen: &Chosen) -> String {
    let o = &chosen.observability;
    let best = chosen.starts.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = chosen.starts.iter().copied().fold(f64::INFINITY, f64::min);
    format!(
        "{count} {what} of {} feasible ones, chosen for {} parameters: O1 {:.4}, O2 {:.2e}, O3 {:.3}, O4 {:.2e}, O5 {:.4} (SI); {} starts reached O1 {least:.4} to {best:.4}",
        chosen.pool,
        chosen.parameters.len(),
        o.o1,
        o.o2,
        o.o3,
        o.o4,
        o.o5,
        chosen.starts.len()
    )
}
