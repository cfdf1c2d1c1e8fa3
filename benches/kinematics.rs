//! W1: pose, 31 Jacobian columns and gravity torques of a configuration. W5: the torques alone.
#![allow(clippy::unwrap_used, missing_docs)]

mod works;

use std::hint::black_box;

use calibench::robot::Posture;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use works::{Arm, golden};

/// The golden numbers are kept to 1e-12; TCP in m, torque in N m, columns in m per SI unit up to 50.
const TOLERANCE: f64 = 1e-11;

/// That pose, torque and columns are those of the independent programs at their 200 configurations.
fn check(arm: &mut Arm<'_>) {
    let (poses, jacobians) = (
        golden::read("fk_torque_200.json").unwrap(),
        golden::read("jac31_200.json").unwrap(),
    );
    let mut columns = [Vector3::zeros(); 31];
    for (k, q) in golden::rows(&poses["q"]).iter().enumerate() {
        arm.set(q);
        arm.columns(&mut columns);
        let pose = golden::numbers(&poses["pose_nominal_pinocchio"][k]);
        let torque = golden::numbers(&poses["tau_pinocchio"][k]);
        let jacobian = golden::numbers(&jacobians["nominal"]["J"][k]);
        for r in 0..3 {
            assert!((arm.posture.tcp()[r] - pose[4 * r + 3]).abs() < TOLERANCE);
            (0..31).for_each(|c| assert!((columns[c][r] - jacobian[31 * r + c]).abs() < TOLERANCE, "column {c}"));
        }
        (0..6).for_each(|j| assert!((arm.loads.tau[j] + torque[j]).abs() < TOLERANCE, "torque {j}"));
    }
}

fn kinematics(c: &mut Criterion) {
    let Some(model) = golden::golden_model() else { return };
    let configurations = works::random_configurations(&model, 100_000);
    let mut arm = Arm::new(&model);
    check(&mut arm);
    let mut group = c.benchmark_group("100,000 configurations");
    group
        .throughput(Throughput::Elements(configurations.len() as u64))
        .sample_size(20);
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
