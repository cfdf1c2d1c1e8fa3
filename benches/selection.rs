//! W3: 80 poses of 5,000 from one start to an optimum that no excursion improves.
#![allow(clippy::unwrap_used, missing_docs)]

mod works;

use std::hint::black_box;

use calibench::measure::poses::selection::{Candidates, Quota, Request, select};
use criterion::{Criterion, criterion_group, criterion_main};
use works::golden;

fn selection(c: &mut Criterion) {
    let model = golden::golden_model();
    let (rows, balls) = works::pool(&model);
    let candidates = Candidates::new(&rows, 31, balls).unwrap();
    let best = select(&candidates, &Request::new(Quota::Free(80))).unwrap();
    assert!(best.o1 >= 0.4223024, "O1 {} is below that of an independent program", best.o1);
    println!("O1 {:.5}, proven bound 0.42308", best.o1);
    let start = |seed: u64| select(&candidates, &Request { starts: 1, seed, ..Request::new(Quota::Free(80)) }).unwrap();
    works::print_least("W3 80 of 5,000, one start", 1, || _ = black_box(start(1)));
    let mut group = c.benchmark_group("W3");
    group.sample_size(20);
    // Every iteration takes another seed: the time of one start varies with its luck.
    let mut seed = 0;
    group.bench_function("80 of 5,000, one start", |b| {
        b.iter(|| {
            seed += 1;
            start(seed)
        });
    });
    group.finish();
}

criterion_group!(benches, selection);
criterion_main!(benches);
