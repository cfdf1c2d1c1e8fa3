//! Loops that run ten thousand times a second do not allocate: kinematics, RelTool, identification, and a whole trial of a
//! study.

use crate::works;
use crate::works::golden;
use crate::works::trial::Trial;
use calibench::identify::Adjustment;
use calibench::identify::problem::{Problem, Use};
use calibench::measure::dataset::NamedDataset;
use nalgebra::Vector3;

/// Number of allocations by `work` in this thread: other tests, and the one that waits for them, do not count.
fn requests(work: impl FnOnce()) -> u64 {
    allocation_counter::measure(work).count_total
}

#[test]
fn hot_loops_do_not_allocate() {
    let model = golden::golden_model();
    assert!(requests(|| drop(std::hint::black_box(vec![1.0]))) > 0, "what allocates is seen");

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
