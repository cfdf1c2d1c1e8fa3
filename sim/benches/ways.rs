//! W9: the plan of the flagship's 80 probings with and without its ways, and the swept check of one motion.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::path::Path;

use calibench::robot::SweptCheck;
use calibench_sim::planning::{find_ways, plan};
use calibench_sim::scenario::load_scenario;
use criterion::{Criterion, criterion_group, criterion_main};

fn ways(c: &mut Criterion) {
    let scenario = load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/paper.toml")).unwrap();
    let seed = 1;
    let planned = plan(&scenario, seed).unwrap();
    let poses = planned.probing.poses;
    let mut group = c.benchmark_group("W9");
    group.sample_size(10);
    group.bench_function("plan of 80 probings and 20 reserves", |b| b.iter(|| black_box(plan(&scenario, seed).unwrap())));
    group.bench_function("its ways alone", |b| {
        b.iter(|| black_box(find_ways(&scenario, seed, None, &mut poses.clone()).unwrap()));
    });
    let cell = scenario.dataset();
    let mut swept = SweptCheck::new(&cell.robot, &cell.base, &cell.tool, &scenario.surroundings());
    // To the end even where it touches, which is how a way's least clearance is found.
    let mut touching = 0;
    for pair in poses.windows(2) {
        let narrowest = swept.narrowest(&pair[0].approach, &pair[1].approach, f64::NEG_INFINITY, None).unwrap();
        touching += usize::from(narrowest.clearance.distance <= 0.0);
    }
    assert!(touching > 0, "the direct motions of this plan touch, or nothing is checked");
    let mut k = 0;
    group.bench_function("swept check of a motion, the mean of all", |b| {
        b.iter(|| {
            k = (k + 1) % (poses.len() - 1);
            black_box(swept.narrowest(&poses[k].approach, &poses[k + 1].approach, f64::NEG_INFINITY, None))
        });
    });
    group.finish();
}

criterion_group!(benches, ways);
criterion_main!(benches);
