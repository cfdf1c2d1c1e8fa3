//! `measure SCENARIO -o DATASET`: probes the balls of the simulated cell.

use std::path::PathBuf;

use calibench::cell::{Manipulator, TriCal};
use calibench::measure::{Dataset, MasteringSettings, master, read_plan, write_dataset};

use super::progress::CampaignBar;
use super::{Failure, Outcome, print, seed};
use crate::planning::{plan, wanted};
use crate::random::Streams;
use crate::run::probe;
use crate::scenario::load_scenario;
use crate::world::{SharedWorld, World};

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
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let scenario = load_scenario(&arguments.scenario)?;
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let cell = scenario.dataset();
    let poses = match &arguments.plan {
        Some(path) => read_plan(path, &cell)?,
        None => plan(&scenario, seed).map_err(|e| scenario.blame_plan(&e))?.probings,
    };
    let world = SharedWorld::new(World::new(&scenario, &Streams { seed, trial: 0 }));
    let clock = || world.robot().clock_s();
    let mastering =
        master(&mut world.indicators(), &mut world.attendant(), &TriCal::default(), &MasteringSettings::default(), clock)
            .map_err(|e| scenario.blame(&e.into()))?;
    let mut bar = CampaignBar::new(wanted(&poses));
    let record = probe(&scenario, &world, &poses, &mastering, &mut bar);
    bar.clear();
    if let Some(abort) = record.aborted {
        return Err(scenario.blame(&abort.into()).into());
    }
    let measured = record.samples.len();
    let dataset = Dataset { contact_force: World::nominal_contact_force(&scenario), samples: record.samples, ..cell };
    write_dataset(&dataset, &arguments.output)?;
    print(&format!("{measured} of {} planned probings measured; dataset in {}", wanted(&poses), arguments.output.display()))?;
    Ok(Outcome::Done)
}
