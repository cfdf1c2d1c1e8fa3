//! W1: pose, 31 Jacobian columns and gravity torques of a configuration. W5: the torques alone.
#![allow(clippy::unwrap_used, missing_docs)]

mod works;

use std::hint::black_box;

use calibench::robot::Posture;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use works::{Arm, golden};

fn kinematics(c: &mut Criterion) {
    let Some(model) = golden::golden_model() else { return };
    let configurations = works::random_configurations(&model, 100_000);
    let mut arm = Arm::new(&model);
    works::check_kinematics(&mut arm);
    let mut group = c.benchmark_group("100,000 configurations");
    group.throughput(Throughput::Elements(configurations.len() as u64)).sample_size(20);
    let mut columns = [Vector3::zeros(); 31];
    group.bench_function("W1 pose, 31 columns, torques", |b| {
        b.iter(|| {
            for q in &configurations {
                arm.set(q);
                arm.columns(&mut columns);
                black_box((arm.posture.tcp(), &columns, &arm.loads));
            }
        });
    });
    group.bench_function("W5 torques", |b| {
        b.iter(|| {
            for q in &configurations {
                arm.set(q);
                black_box(&arm.loads.tau);
            }
        });
    });
    let mut posture = Posture::new(&model.robot);
    let nominal = vec![0.0; calibench::robot::SiteIndex::new(6).len()];
    group.bench_function("pose alone", |b| {
        b.iter(|| {
            for q in &configurations {
                posture.set(&model.robot, &model.base, &model.tool, q, &nominal);
                black_box(posture.tcp());
            }
        });
    });
    group.finish();
}

criterion_group!(benches, kinematics);
criterion_main!(benches);
