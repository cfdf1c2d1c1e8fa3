//! Loops that run ten thousand times a second do not allocate: kinematics, RelTool, identification, and a whole trial of a
//! study.

use crate::works;
use calibench::measure::dataset::NamedDataset;
use std::alloc::System;
use std::process::Command;

use crate::works::golden;
use crate::works::trial::Trial;
use calibench::identify::Adjustment;
use calibench::identify::problem::{Problem, Use};
use nalgebra::Vector3;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static MEMORY: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Number of allocations by `work`.
fn requests(mut work: impl FnMut()) -> usize {
    let region = Region::new(MEMORY);
    work();
    let change = region.change();
    change.allocations + change.reallocations
}

/// The memory of every other test in this process would be counted too: this one gets a process of its own.
#[test]
fn hot_loops_do_not_allocate() {
    const ALONE: &str = "CALIBENCH_TEST_ALONE";
    if std::env::var_os(ALONE).is_some() {
        return count();
    }
    let name = concat!(module_path!(), "::hot_loops_do_not_allocate");
    let name = name.split_once("::").unwrap().1;
    let program = std::env::current_exe().unwrap();
    let run = Command::new(program).args(["--exact", name, "--nocapture"]).env(ALONE, "1").output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert!(run.status.success() && said.contains("1 passed"), "{said}");
}

fn count() {
    let model = golden::golden_model();
    assert!(requests(|| drop(vec![1.0])) > 0, "what allocates is seen");

    let (mut arm, mut arms) = (works::Arm::new(&model), works::Arms::new(&model));
    let configurations = works::random_configurations(&model, 24);
    let mut columns = [Vector3::zeros(); 31];
    let kinematics = requests(|| {
        for eight in configurations.as_chunks().0 {
            arms.set(&works::BatchOfPostures::of(eight));
            arms.find_columns();
        }
        for q in &configurations {
            arm.set(q);
            arm.columns(&mut columns);
        }
    });
    assert_eq!(kinematics, 0);

    let dataset = works::centred(&model);
    let mut problem = Problem::new(&[NamedDataset::new("w2", &dataset)], &works::frozen_torques(), Use::Fit).unwrap();
    let start = problem.start();
    let all: Vec<usize> = (0..start.len()).collect();
    let mut adjustment = Adjustment::new(&problem, &start, &all).unwrap();
    let mut identify = || {
        problem.renew(&[&dataset.samples]).unwrap();
        adjustment.adjust(&problem, &start).unwrap();
    };
    // The first may find room for what it keeps.
    identify();
    assert_eq!(requests(&mut identify), 0);

    let truths = works::truths();
    let mut trial = Trial::new(&model);
    trial.run(&truths[0], 0);
    assert_eq!(requests(|| _ = trial.run(&truths[1], 1)), 0);
}
