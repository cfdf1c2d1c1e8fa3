//! In the median over 20 seeds (a study; over three of them in every run of the tests), the scenarios `paper` and `paper-refit` reproduce the position errors of the paper's Table 9,
//! for the TriCal and for the tracker; and the model discrepancy of `paper-refit` is plausible for a robot.

use std::ops::RangeInclusive;
use std::path::Path;

use calibench::residuals::Validation;
use calibench::units::MM;
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{Run, run};
use calibench_sim::scenario::{Scenario, load_scenario};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Scenarios, with the largest deviations from Table 9 allowed: of the means, the maxima, the standard deviations.
const SCENARIOS: [(&str, [f64; 3]); 2] = [("paper", [0.10, 0.25, 0.15]), ("paper-refit", [0.08; 3])];

/// Largest parameter of the refitted discrepancy, in units of its plausible size.
const LARGEST: f64 = 2.5;

/// Quantiles between which the chi-square of all of them must lie.
const QUANTILES: [f64; 2] = [0.05, 0.95];

fn scenario(name: &str) -> Scenario {
    load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenarios/{name}.toml"))).unwrap()
}

/// Both rows, on the median of an odd or even number of seeds.
fn both_rows(seeds: RangeInclusive<u64>) {
    let scenarios = SCENARIOS.map(|(name, _)| scenario(name));
    let of = |v: &Validation| [v.mean / MM, v.max / MM, v.std / MM];
    let errors = |scenario: &Scenario, plans: Plans, seed: u64| {
        let Run { trical, tracker, .. } = run(scenario, plans, Streams { seed, trial: 0 }, &mut ()).unwrap();
        [of(&trical.validation), of(&tracker.validation)]
    };
    let rows: Vec<[[[f64; 3]; 2]; 2]> = seeds
        .into_par_iter()
        .map(|seed| {
            // All scenarios have the same cell, so one plan serves both truths.
            let plans = Plans::new(&scenarios[0], seed).unwrap();
            [errors(&scenarios[0], plans.clone(), seed), errors(&scenarios[1], plans, seed)]
        })
        .collect();
    for (s, (name, bands)) in SCENARIOS.iter().enumerate() {
        for (m, (method, paper)) in
            [("TriCal", [0.326, 0.624, 0.107]), ("tracker", [0.231, 0.539, 0.087])].into_iter().enumerate()
        {
            for k in 0..3 {
                let mut values: Vec<f64> = rows.iter().map(|r| r[s][m][k]).collect();
                values.sort_by(f64::total_cmp);
                let median = (values[(values.len() - 1) / 2] + values[values.len() / 2]) / 2.0;
                let what = ["mean", "max", "std"][k];
                println!("{name:12} {method:8} {what:4} median {median:.3}, paper {:.3}", paper[k]);
                assert!(
                    (median / paper[k] - 1.0).abs() < bands[k],
                    "{name}, {method} {what}: {median:.3} mm, paper {}",
                    paper[k]
                );
            }
        }
    }
}

#[test]
fn both_rows_on_the_median_of_three_seeds() {
    both_rows(1..=3);
}

#[test]
#[ignore = "a study of 20 robots: validation/run both_rows_of_table_9_come_out"]
fn both_rows_on_the_median_of_twenty_seeds() {
    both_rows(1..=20);
}

#[test]
fn the_refitted_layer_is_one_that_a_robot_may_have() {
    let scenario = scenario("paper-refit");
    let mut sizes = Vec::new();
    for effect in scenario.truth().drawn(&Streams { seed: 1, trial: 0 }) {
        if !scenario.model.holds(effect.effect.id()) {
            sizes.extend(effect.effect.parameters().iter().zip(&effect.sizes).map(|(p, size)| size / p.prior));
        }
    }
    sizes.retain(|size| *size != 0.0);
    let largest = sizes.iter().fold(0.0, |a: f64, s| a.max(s.abs()));
    let squares: f64 = sizes.iter().map(|s| s * s).sum();
    let chance = ChiSquared::new(sizes.len() as f64).unwrap().cdf(squares);
    println!("{} numbers, largest {largest:.2}, chi-square {squares:.1}, {chance:.3} have less", sizes.len());
    assert!(sizes.len() > 50 && largest < LARGEST, "{} numbers, largest {largest}", sizes.len());
    assert!((QUANTILES[0]..=QUANTILES[1]).contains(&chance), "{squares} of {}: {chance}", sizes.len());
}

/// The discrepancy is hidden behind the 31 parameters: the identified values are those printed in the paper,
/// compliances by magnitude.
#[test]
fn the_refitted_robot_is_identified_as_table_8() {
    let (refit, table8) = (scenario("paper-refit"), scenario("table8"));
    let result = run(&refit, Plans::new(&refit, 1).unwrap(), Streams { seed: 1, trial: 0 }, &mut ()).unwrap();
    for effect in table8.truth().drawn(&Streams { seed: 1, trial: 0 }) {
        for (parameter, printed) in effect.effect.parameters().iter().zip(&effect.sizes) {
            // Parameters absent from Table 8 cannot be determined from the data either.
            let Some(found) = result.trical.calibration.estimate(&parameter.name) else { continue };
            let off = (found.value - found.nominal - printed).abs();
            // Noise, plus a tenth of the plausible size for nonlinearity and for rounding in the scenario.
            assert!(off < 4.0 * found.sigma_noise + 0.1 * parameter.prior, "{}: {off} off {printed}", parameter.name);
        }
    }
}
