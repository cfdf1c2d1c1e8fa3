//! Prints how often checks of simulated cells find and name what happened: `checks SCENARIO CELLS SIZE SEED`.

use std::collections::BTreeMap;

use calibench_lab::checks::{Checks, table};
use calibench_sim::scenario::load_scenario;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scenario, cells, size, seed] = arguments.as_slice() else {
        return Err("checks SCENARIO CELLS SIZE SEED".into());
    };
    let scenario = load_scenario(scenario.as_ref())?;
    let checks = Checks { sentinels: 5, size: size.parse()?, seed: seed.parse()? };
    println!("| what happened | checks | found | named | poses probed |");
    println!("|---|---|---|---|---|");
    let outcomes = checks.run(&scenario, cells.parse()?)?;
    for row in table(&outcomes) {
        println!("| {} | {} | {} | {} | {:.1} |", row.fault.words(), row.checks, row.found, row.named, row.used);
    }
    let mut mistaken: BTreeMap<(&str, String), usize> = BTreeMap::new();
    for outcome in &outcomes {
        // Of balls, joints and samples the kind alone counts.
        let kind = outcome.mistaken_for.as_ref().map(|name| name.split(':').next().unwrap_or_default().to_owned());
        *kind.map_or(&mut 0, |kind| mistaken.entry((outcome.fault.words(), kind)).or_default()) += 1;
    }
    for ((fault, kind), count) in mistaken {
        println!("{fault} mistaken for {kind}: {count}");
    }
    Ok(())
}
