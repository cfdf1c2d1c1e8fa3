//! Prints how often checks of simulated cells find and name what happened: `checks SCENARIO CELLS SIZE SEED`.

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
    for row in table(&checks.run(&scenario, cells.parse()?)?) {
        println!("| {} | {} | {} | {} | {:.1} |", row.fault.words(), row.checks, row.found, row.named, row.used);
    }
    Ok(())
}
