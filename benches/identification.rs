//! W2: identification of the 31 parameters from 80 centrings, from nominal to convergence.
#![allow(clippy::unwrap_used, missing_docs)]

mod works;

use calibench::measure::dataset::NamedDataset;
use std::hint::black_box;

use calibench::identify::fit::{fit, independent_parameters};
use calibench::identify::problem::{Problem, Use};
use calibench::identify::{Adjustment, Model, identify};
use criterion::{Criterion, criterion_group, criterion_main};
use works::golden;

fn identification(c: &mut Criterion) {
    let model = golden::golden_model();
    let dataset = works::centred(&model);
    let named = [NamedDataset::new("w2", &dataset)];
    let frozen = works::frozen_torques();
    let mut problem = Problem::new(&named, &frozen, Use::Fit).unwrap();
    let start = problem.start();
    let all: Vec<usize> = (0..start.len()).collect();
    let mut adjustment = Adjustment::new(&problem, &start, &all).unwrap();
    adjustment.adjust(&problem, &start).unwrap();
    works::check_identification(&problem, adjustment.values());

    let mut group = c.benchmark_group("W2");
    let mut bench = |name: &str, work: &mut dyn FnMut()| {
        works::print_least(name, 1, &mut *work);
        group.bench_function(name, |b| b.iter(&mut *work));
    };
    // All that depends on what was measured: torques, residuals, Gauss-Newton.
    bench("identification", &mut || {
        problem.renew(&[&dataset.samples]).unwrap();
        adjustment.adjust(&problem, &start).unwrap();
        black_box(adjustment.values());
    });
    bench("  of it taking the samples and weighing", &mut || problem.renew(&[&dataset.samples]).unwrap());
    bench("  of it Gauss-Newton", &mut || adjustment.adjust(&problem, &start).unwrap());
    bench("covariance", &mut || _ = black_box(adjustment.covariance()));
    // What the first of many identifications pays besides.
    bench("rank analysis", &mut || _ = black_box(independent_parameters(&problem)));
    bench("laying out the problem", &mut || _ = black_box(Problem::new(&named, &frozen, Use::Fit)));
    bench("fit: rank analysis, Gauss-Newton, covariance, observability", &mut || _ = black_box(fit(&problem)));
    bench("identify: all of it, from dataset to calibration", &mut || _ = black_box(identify(&named, &frozen)));
    bench("identify, torques weighed where the arm is found", &mut || _ = black_box(identify(&named, &Model::paper())));
    group.finish();
}

criterion_group!(benches, identification);
criterion_main!(benches);
