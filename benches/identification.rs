//! W2: identification of the 31 parameters from 80 centrings.
#![allow(clippy::unwrap_used, missing_docs)]

mod works;

use calibench::identify::{Adjustment, Problem, Use, fit, identify, independent_parameters};
use criterion::{Criterion, criterion_group, criterion_main};
use works::golden;

fn identification(c: &mut Criterion) {
    let Some(model) = golden::golden_model() else { return };
    let dataset = works::centred(&model);
    let frozen = works::frozen_torques();
    let mut group = c.benchmark_group("W2");
    let named = [("w2", &dataset)];
    group.bench_function("identify", |b| b.iter(|| identify(&named, &frozen).unwrap()));
    group.bench_function("problem new", |b| b.iter(|| Problem::new(&named, &frozen, Use::Fit).unwrap()));
    let mut problem = Problem::new(&named, &frozen, Use::Fit).unwrap();
    group.bench_function("fit", |b| b.iter(|| fit(&mut problem).unwrap()));
    group.bench_function("rank", |b| b.iter(|| independent_parameters(&problem).unwrap()));
    group.bench_function("renew", |b| b.iter(|| problem.renew(&[&dataset.samples]).unwrap()));
    let start = problem.start();
    let all: Vec<usize> = (0..start.len()).collect();
    let mut adjustment = Adjustment::new(&problem, &start, &all).unwrap();
    group.bench_function("adjust", |b| b.iter(|| adjustment.adjust(&mut problem, &start).unwrap()));
    group.bench_function("renew and adjust", |b| {
        b.iter(|| {
            problem.renew(&[&dataset.samples]).unwrap();
            adjustment.adjust(&mut problem, &start).unwrap();
        });
    });
    group.bench_function("covariance", |b| b.iter(|| adjustment.covariance().unwrap()));
    group.finish();
}

criterion_group!(benches, identification);
criterion_main!(benches);
