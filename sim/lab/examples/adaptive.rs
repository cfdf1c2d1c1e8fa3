//! Prints adaptive campaigns beside campaigns of fixed length: `adaptive SCENARIO ROBOTS WANTED_MM SEED [POSES_PER_BALL...]`.

use calibench::units::MM;
use calibench_lab::adaptive::{adaptive, figures, fixed};
use calibench_sim::scenario::load_scenario;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scenario, robots, wanted, seed, fixed_lengths @ ..] = arguments.as_slice() else {
        return Err("adaptive SCENARIO ROBOTS WANTED_MM SEED [POSES_PER_BALL...]".into());
    };
    let scenario = load_scenario(scenario.as_ref())?;
    let (robots, wanted, seed): (usize, f64, u64) = (robots.parse()?, wanted.parse::<f64>()? * MM, seed.parse()?);
    println!("| campaign | probings | true mean error mm | robots below {:.3} mm |", wanted / MM);
    println!("|---|---|---|---|");
    let campaigns = adaptive(&scenario, robots, wanted, seed)?;
    let [probings, error, below] = figures(&campaigns, wanted);
    let mut counts: Vec<usize> = campaigns.iter().map(|c| c.probings).collect();
    counts.sort_unstable();
    let stopped: Vec<_> = campaigns.iter().filter(|c| c.enough).copied().collect();
    let [.., truly] = figures(&stopped, wanted);
    println!(
        "| adaptive ({} of {robots} stopped, {:.0} % of them truly below) | {probings:.1} ({} to {}) | {error:.4} | {:.0} % |",
        stopped.len(),
        100.0 * truly,
        counts[0],
        counts[counts.len() - 1],
        100.0 * below
    );
    for length in fixed_lengths {
        let mut shorter = scenario.clone();
        shorter.plan.poses_per_ball = length.parse()?;
        let [probings, error, below] = figures(&fixed(&shorter, robots, seed)?, wanted);
        println!("| fixed | {probings:.0} | {error:.4} | {:.0} % |", 100.0 * below);
    }
    Ok(())
}
