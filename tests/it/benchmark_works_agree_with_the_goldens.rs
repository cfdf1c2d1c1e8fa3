//! The benchmark works W1 to W5 do what independent programs did: what is timed in `benches/` is checked here at a small size. W6 is
//! checked beside the simulated plungers.

use crate::works;
use crate::works::golden;
use crate::works::trial::{Outcome, Trial, check};
use calibench::identify::Adjustment;
use calibench::identify::problem::{Problem, ProblemError, Use};
use calibench::measure::dataset::NamedDataset;
use calibench::measure::poses::selection::{Candidates, Quota, Request, select};

#[test]
fn w1_and_w5_are_poses_columns_and_torques_of_pinocchio_and_jax() {
    let model = golden::golden_model();
    works::check_kinematics(&mut works::Arm::new(&model));
    works::check_batch(&model);
    assert_eq!(works::random_configurations(&model, 3).len(), 3);
}

#[test]
fn w2_ends_at_the_parameters_of_scipy_whatever_was_identified_before() {
    let model = golden::golden_model();
    let dataset = works::centred(&model);
    // Laid out and adjusted for the uncentred starts of W4, which are other poses of the same balls.
    let mut started = dataset.clone();
    for (sample, other) in started.samples.iter_mut().zip(works::centring_starts()) {
        sample.q = other.q;
    }
    let mut problem = Problem::new(&[NamedDataset::new("w2", &started)], &works::frozen_torques(), Use::Fit).unwrap();
    let start = problem.start();
    let all: Vec<usize> = (0..start.len()).collect();
    let mut adjustment = Adjustment::new(&problem, &start, &all).unwrap();
    adjustment.adjust(&problem, &start).unwrap();
    problem.renew(&[&dataset.samples]).unwrap();
    adjustment.adjust(&problem, &start).unwrap();
    assert_eq!(adjustment.iterations(), 4, "as many Gauss-Newton steps as the reference");
    works::check_identification(&problem, adjustment.values());
}

#[test]
fn samples_of_another_plan_are_refused_and_change_nothing() {
    let model = golden::golden_model();
    let dataset = works::centred(&model);
    let mut problem = Problem::new(&[NamedDataset::new("w2", &dataset)], &works::frozen_torques(), Use::Fit).unwrap();
    let before = problem.residuals(&problem.start());
    let mut swapped = dataset.samples.clone();
    let other = swapped.iter().position(|s| s.measured != swapped[0].measured).unwrap();
    swapped.swap(0, other);
    for samples in [&swapped[..], &swapped[..79], &[&dataset.samples[..], &swapped[..1]].concat()] {
        assert!(matches!(problem.renew(&[samples]), Err(ProblemError::AnotherPlan { .. })));
        assert_eq!(problem.residuals(&problem.start()), before);
    }
}

#[test]
fn w3_ends_near_the_bound_from_one_start() {
    let model = golden::golden_model();
    let (rows, balls) = works::pool(&model);
    let candidates = Candidates::new(&rows, 31, balls).unwrap();
    let found = select(&candidates, &Request { starts: 1, seed: 1, ..Request::new(Quota::Free(80)) }).unwrap();
    // Every start of every program that was tried ended between these; the second is a proven bound.
    assert!((0.4218..0.42308).contains(&found.o1), "{}", found.o1);
}

#[test]
fn w4_finds_robots_as_well_as_independent_programs_do() {
    let model = golden::golden_model();
    let mut trial = Trial::new(&model);
    let outcomes: Vec<Outcome> = (0..).zip(&works::truths()).map(|(seed, truth)| trial.run(truth, seed)).collect();
    check(&outcomes);
    assert_eq!(trial.run(&works::truths()[3], 3), outcomes[3], "a trial depends on its truth and its seed alone");
}
