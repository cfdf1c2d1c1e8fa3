//! `measure SCENARIO -o DATASET`: probes the balls of the simulated cell.

use std::path::PathBuf;

use calibench::measure::{Dataset, PlannedPose, Sample, SampleSet, Witness, read_plan, write_dataset};

use super::progress::{CampaignBar, Waiting};
use super::{Failure, Outcome, print, seed};
use crate::planning::{PlanError, plan, plan_tracker, wanted};
use crate::random::Streams;
use crate::run::RunError;
use crate::scenario::PlantKind;
use crate::scenario::{Scenario, load_scenario};
use crate::session::{Session, session_s};
use crate::world::World;

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file
    scenario: PathBuf,
    /// Where to write the dataset (a folder); a dataset that is there is replaced
    #[arg(short, long, visible_alias = "out")]
    output: PathBuf,
    /// A plan that `plan` wrote; the default is to plan anew
    #[arg(long)]
    plan: Option<PathBuf>,
    /// Seed in place of the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Who plays the mechanics of the cell, in place of the scenario's choice
    #[arg(long, value_enum)]
    plant: Option<PlantKind>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut scenario = load_scenario(&arguments.scenario)?;
    scenario.plant = arguments.plant.unwrap_or(scenario.plant);
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let cell = scenario.dataset();
    let waiting = Waiting::new("planning");
    let poses = match &arguments.plan {
        Some(path) => read_plan(path, &cell)?,
        None => plan(&scenario, seed).map_err(|e| scenario.blame_plan(&e))?.probings,
    };
    // The plan file holds poses on balls; where the tracker adds points, the scenario says how many.
    let points = if scenario.plan.point_poses > 0 {
        plan_tracker(&scenario, seed).map_err(|e| scenario.blame_plan(&PlanError::Tracker(Box::new(e))))?.points
    } else {
        Vec::new()
    };
    drop(waiting);
    let mut bar = CampaignBar::new(wanted(&poses));
    let measured = measure(&scenario, Streams { seed, trial: 0 }, &poses, &points, &mut bar);
    drop(bar);
    let samples = measured.map_err(|e| scenario.blame(&e))?;
    let probed = samples.len() - points.len();
    let dataset = Dataset { contact_force: World::nominal_contact_force(&scenario), samples, ..cell };
    write_dataset(&dataset, &arguments.output)?;
    let and_points = if points.is_empty() { String::new() } else { format!(" and {} points", points.len()) };
    print(&format!(
        "{probed} of {} planned probings{and_points} measured; dataset in {}",
        wanted(&poses),
        arguments.output.display()
    ))?;
    Ok(Outcome::Done)
}

fn measure(
    scenario: &Scenario,
    streams: Streams,
    poses: &[PlannedPose],
    points: &[Vec<f64>],
    witness: &mut dyn Witness,
) -> Result<Vec<Sample>, RunError> {
    let session = Session::begin(scenario, streams, session_s(scenario, poses, points.len()))?;
    let record = session.probe(poses, witness);
    if let Some(abort) = record.aborted {
        return Err(abort.into());
    }
    let mut samples = record.samples;
    if !points.is_empty() {
        let tracker = session.set_up_tracker()?;
        samples.extend(session.points(&tracker, points, "t", SampleSet::Fit)?.samples);
    }
    Ok(samples)
}
