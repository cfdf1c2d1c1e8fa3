//! W1: pose, 31 Jacobian columns and gravity torques of a configuration. W5: the torques alone. Each alone, and eight side by side.
#![allow(clippy::unwrap_used, missing_docs)]

mod works;

use std::hint::black_box;
use std::ops::Range;

use calibench::robot::kinematics::Posture;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use works::{Arm, Arms, BatchOfPostures, LANES, golden};

/// Configurations of one short run.
const FEW: usize = 50 * LANES;

fn kinematics(c: &mut Criterion) {
    let model = golden::golden_model();
    let configurations = works::random_configurations(&model, 100_000);
    let mut arm = Arm::new(&model);
    let mut arms = Arms::new(&model);
    works::check_kinematics(&mut arm);
    works::check_batch(&model);
    let side_by_side: Vec<BatchOfPostures> = configurations.as_chunks().0.iter().map(BatchOfPostures::of).collect();
    let mut group = c.benchmark_group("100,000 configurations");
    group.throughput(Throughput::Elements(configurations.len() as u64)).sample_size(20);
    let mut columns = [Vector3::zeros(); 31];
    let mut posture = Posture::new(&model.robot);
    let nominal = vec![0.0; calibench::robot::sites::SiteIndex::new(6).len()];
    let mut bench = |name: &str, work: &mut dyn FnMut(Range<usize>)| {
        works::print_least(name, FEW, || work(0..FEW));
        group.bench_function(name, |b| b.iter(|| work(0..configurations.len())));
    };
    bench("W1 pose, 31 columns, torques", &mut |some| {
        for q in &configurations[some] {
            arm.set(q);
            arm.columns(&mut columns);
            black_box((arm.posture.tcp(), &columns, &arm.loads));
        }
    });
    bench("W1 side by side", &mut |some| {
        for eight in &side_by_side[some.start / LANES..some.end / LANES] {
            arms.set(eight);
            arms.find_columns();
            black_box((&arms.postures, arms.column(0), &arms.loads));
        }
    });
    bench("W5 torques", &mut |some| {
        for q in &configurations[some] {
            arm.set(q);
            black_box(&arm.loads.tau);
        }
    });
    bench("W5 side by side", &mut |some| {
        for eight in &side_by_side[some.start / LANES..some.end / LANES] {
            arms.set(eight);
            black_box(&arms.loads);
        }
    });
    bench("pose alone", &mut |some| {
        for q in &configurations[some] {
            posture.set(&model.robot, &model.base, &model.tool, q, &nominal);
            black_box(posture.tcp());
        }
    });
    group.finish();
}

criterion_group!(benches, kinematics);
criterion_main!(benches);
