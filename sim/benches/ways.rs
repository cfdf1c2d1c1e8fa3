//! W9: the plan of the flagship's 80 probings with and without its ways, and the swept check of one motion.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use calibench::measure::poses::ways::WAY_MARGIN;
use calibench::robot::solids::SweptCheck;
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
    // Each motion is first swept to its end even after a contact, as when the least clearance of a way is computed, and
    // then only until the gap is narrower than a way may have.
    for (enough, what) in [(f64::NEG_INFINITY, "to its narrowest gap"), (WAY_MARGIN, "whether it is a way")] {
        let mut touching = 0;
        let mut times: Vec<f64> = Vec::with_capacity(poses.len());
        for pair in poses.windows(2) {
            let began = Instant::now();
            let narrowest = swept.narrowest(&pair[0].approach, &pair[1].approach, enough, None).unwrap();
            times.push(began.elapsed().as_secs_f64());
            touching += usize::from(narrowest.clearance.distance <= 0.0);
        }
        times.sort_by(f64::total_cmp);
        println!("swept check of a motion {what}: median {:.2} ms, once each", 1e3 * times[times.len() / 2]);
        assert!(enough > 0.0 || touching > 0, "the direct motions of this plan touch, or nothing is checked");
    }
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
