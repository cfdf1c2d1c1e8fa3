//! How plausible the truth of a scenario is, and how near it comes to what the paper says of its robot:
//! `cargo run --release -p calibench-sim --example how_plausible -- scenarios/paper.toml [SEEDS [FIRST]]`.
//!
//! Prints the numbers of all effects that the model does not hold in their plausible sizes, with the chi-square of all together; and, on
//! so many seeds from the first one (20 from 1 where not said), the medians of both rows of Table 9, of the robot as drawn, and of the first contacts.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use calibench::residuals::Validation;
use calibench::units::MM;
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{Run, run};
use calibench_sim::scenario::{Scenario, load_scenario};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// What is looked at, and what the paper says of it, mm. Of the robot as drawn and of first contacts it says "less than 4 mm" and "well
/// within the 5-mm measurement range".
const QUANTITIES: [(&str, Option<f64>); 10] = [
    ("TriCal mean", Some(0.326)),
    ("TriCal maximum", Some(0.624)),
    ("TriCal standard deviation", Some(0.107)),
    ("tracker mean", Some(0.231)),
    ("tracker maximum", Some(0.539)),
    ("tracker standard deviation", Some(0.087)),
    ("as drawn, mean", None),
    ("as drawn, maximum", Some(4.0)),
    ("largest first contact", Some(5.0)),
    ("first contacts beyond 5 mm", None),
];

/// Seeds that are carried out at once.
const MOST_SEEDS: u64 = 10_000;

/// Beyond so many plausible sizes a number counts as unusual.
const UNUSUAL: [f64; 2] = [2.0, 2.5];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let number = |k: usize, otherwise: u64| arguments.get(k).map_or(Some(otherwise), |n| n.parse().ok());
    let seeds = number(2, 20).filter(|n| (1..=MOST_SEEDS).contains(n)).zip(number(3, 1).filter(|&f| f < u64::MAX - MOST_SEEDS));
    let (Some(path), Some((count, first))) = (arguments.get(1), seeds) else {
        eprintln!("how_plausible: give a scenario, how many seeds (1 to {MOST_SEEDS}), and the first of them");
        return ExitCode::from(2);
    };
    let seeds: Vec<u64> = (first..first + count).collect();
    match load_scenario(Path::new(path)).map_err(|e| e.to_string()).and_then(|s| told(&s, &seeds)) {
        Ok(text) => {
            // Whoever closes the pipe has seen enough.
            drop(std::io::stdout().write_all(text.as_bytes()));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("how_plausible: {error}");
            ExitCode::from(2)
        }
    }
}

/// The sizes, then the medians.
fn told(scenario: &Scenario, seeds: &[u64]) -> Result<String, String> {
    let one = |&seed: &u64| {
        let plans = Plans::new(scenario, seed).map_err(|e| e.to_string())?;
        run(scenario, plans, Streams { seed, trial: 0 }, &mut ()).map(|run| numbers(&run)).map_err(|e| e.to_string())
    };
    let rows: Vec<[f64; QUANTITIES.len()]> = seeds.par_iter().map(one).collect::<Result<_, _>>()?;
    let mut text = sizes_told(scenario);
    text.push_str(&format!("median of {} seeds (least to largest), mm:\n", seeds.len()));
    for (k, (name, paper)) in QUANTITIES.iter().enumerate() {
        let mut values: Vec<f64> = rows.iter().map(|r| r[k]).collect();
        values.sort_by(f64::total_cmp);
        let (least, largest) = (values[0], values[values.len() - 1]);
        let median = 0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2]);
        let against = paper.map_or_else(String::new, |p| format!("; the paper {p} ({:+.1} %)", 100.0 * (median / p - 1.0)));
        text.push_str(&format!("  {name:28} {median:7.3} ({least:.3} to {largest:.3}){against}\n"));
    }
    Ok(text)
}

/// Sizes of what the model does not hold, in plausible sizes.
fn sizes_told(scenario: &Scenario) -> String {
    let held = |id: &str| scenario.model.holds(id);
    let mut sizes: Vec<(String, f64)> = Vec::new();
    for effect in scenario.truth().drawn(&Streams { seed: scenario.seed, trial: 0 }) {
        if !held(effect.effect.id()) {
            let stated = effect.effect.parameters().iter().zip(&effect.sizes).filter(|(_, size)| **size != 0.0);
            sizes.extend(stated.map(|(p, size)| (p.name.clone(), size / p.prior)));
        }
    }
    sizes.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let squares: f64 = sizes.iter().map(|(_, s)| s * s).sum();
    let chance = ChiSquared::new(sizes.len().max(1) as f64).map_or(f64::NAN, |d| d.cdf(squares));
    let beyond = UNUSUAL.map(|u| format!("{} beyond {u}", sizes.iter().filter(|(_, s)| s.abs() > u).count()));
    let largest: Vec<String> = sizes.iter().take(8).map(|(name, s)| format!("{name} {s:+.2}")).collect();
    format!(
        "{}: {} numbers in plausible sizes, {}; chi-square {squares:.1}, {:.3} % of robots have less, {:.1e} have more\nlargest: {}\n",
        scenario.name,
        sizes.len(),
        beyond.join(", "),
        100.0 * chance,
        1.0 - chance,
        largest.join(", ")
    )
}

fn numbers(run: &Run) -> [f64; QUANTITIES.len()] {
    let of = |v: &Validation| [v.mean / MM, v.max / MM, v.std / MM];
    let ([a, b, c], [d, e, f]) = (of(&run.trical.validation), of(&run.tracker.validation));
    let contacts = first_contacts(run);
    let largest = contacts.iter().copied().fold(0.0, f64::max);
    let beyond = contacts.iter().filter(|&&c| c > 5.0).count() as f64;
    [a, b, c, d, e, f, run.before.mean / MM, run.before.max / MM, largest, beyond]
}

/// Distance of the gauge's first reading from the ball's centre, mm, of every probing that read one.
fn first_contacts(run: &Run) -> Vec<f64> {
    run.campaign.probings.iter().filter_map(|p| p.probing.first_reading()).map(|r| r.norm() / MM).collect()
}
