//! W4: one whole calibration: 80 centrings of a true robot, identification from nominal, validation on 500 configurations.
#![allow(clippy::unwrap_used, missing_docs)]

mod works;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use works::golden;
use works::trial::{Outcome, Trial, averages, check};

fn trial(c: &mut Criterion) {
    let model = golden::golden_model();
    let truths = works::truths();
    let mut trial = Trial::new(&model);
    let outcomes: Vec<Outcome> = (0..).zip(&truths).map(|(seed, truth)| trial.run(truth, seed)).collect();
    let [mean, max, residual, readings] = averages(&outcomes);
    println!(
        "{} trials: mean {:.3} um (+- {:.3}), max {:.3} (+- {:.3}), residual {:.4}, readings {:.4}",
        outcomes.len(),
        mean.0 * 1e6,
        mean.1 * 1e6,
        max.0 * 1e6,
        max.1 * 1e6,
        residual.0 * 1e6,
        readings.0
    );
    check(&outcomes);

    let mut seed = 0;
    let mut next = || {
        seed += 1;
        black_box(trial.run(&truths[seed as usize % truths.len()], seed));
    };
    works::print_least("W4 trial", 1, &mut next);
    let mut group = c.benchmark_group("W4");
    group.bench_function("trial", |b| b.iter(&mut next));
    group.finish();
}

criterion_group!(benches, trial);
criterion_main!(benches);
