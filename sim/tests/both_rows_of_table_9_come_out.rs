//! On the median of 20 seeds, scenario `paper` leaves the position errors of the paper's Table 9, for the TriCal and for the tracker.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use calibench::assess::Validation;
use calibench::units::MM;
use calibench_sim::random::Streams;
use calibench_sim::run::{Plans, Run, run};
use calibench_sim::scenario::load_scenario;
use rayon::prelude::*;

/// Largest departures from Table 9 allowed: of the means, the maxima, the standard deviations.
const BANDS: [f64; 3] = [0.10, 0.25, 0.15];

#[test]
fn both_rows_on_the_median_of_twenty_seeds() {
    let scenario = load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/paper.toml")).unwrap();
    let of = |v: &Validation| [v.mean / MM, v.max / MM, v.std / MM];
    let rows: Vec<[[f64; 3]; 2]> = (1..=20)
        .into_par_iter()
        .map(|seed| {
            let Run { trical, tracker, .. } =
                run(&scenario, Plans::new(&scenario, seed).unwrap(), Streams { seed, trial: 0 }, &mut ()).unwrap();
            [of(&trical.validation), of(&tracker.validation)]
        })
        .collect();
    for (m, (method, paper)) in [("TriCal", [0.326, 0.624, 0.107]), ("tracker", [0.231, 0.539, 0.087])].into_iter().enumerate()
    {
        for k in 0..3 {
            let mut values: Vec<f64> = rows.iter().map(|r| r[m][k]).collect();
            values.sort_by(f64::total_cmp);
            let median = (values[9] + values[10]) / 2.0;
            let what = ["mean", "max", "std"][k];
            println!("{method:8} {what:4} median {median:.3}, paper {:.3}", paper[k]);
            assert!((median / paper[k] - 1.0).abs() < BANDS[k], "{method} {what}: {median:.3} mm against {}", paper[k]);
        }
    }
}
