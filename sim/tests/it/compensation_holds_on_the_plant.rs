//! In the simulated cell the error of compensated targets falls from millimetres to the level of the identified model on the
//! tracker's validation poses: 500 targets are sent to the robot's own controller, which knows the nominal model; the truth
//! is taken from the plant.

use std::path::Path;

use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{Run, run};
use calibench_sim::scenario::load_scenario;

/// Errors of compensated targets over those of the model on the validation poses. Both are of the same arm at almost the same
/// postures; only the latter contain the tracker's noise.
const RATIO: f64 = 1.05;

fn run_of(name: &str) -> Run {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios").join(name);
    let scenario = load_scenario(&path).unwrap();
    let seed = scenario.seed;
    run(&scenario, Plans::new(&scenario, seed).unwrap(), Streams { seed, trial: 0 }, &mut ()).unwrap()
}

#[test]
fn on_the_papers_robot_millimetres_become_the_validation_error() {
    let run = run_of("paper.toml");
    let compensation = run.compensation.as_ref().unwrap();
    let (before, after, model) = (&compensation.before, &compensation.after, &run.trical.validation);
    assert!(after.samples >= 490, "{} compensated, {} refused", after.samples, compensation.refused);
    assert!(before.mean > 1e-3, "{}", before.mean);
    assert!(after.mean <= RATIO * model.mean, "{} against {}", after.mean, model.mean);
    assert!(after.rms <= RATIO * model.rms, "{} against {}", after.rms, model.rms);
    assert!(after.max <= 1.1 * model.max, "{} against {}", after.max, model.max);
    // The same robot is assessed, not a better one.
    assert!(after.mean > 0.85 * model.mean, "{} against {}", after.mean, model.mean);
}

/// If the model is complete, only non-repeatable errors remain: encoders, lost motion, and the noise of the calibration.
#[test]
fn where_the_model_is_complete_hundredths_of_a_millimetre_are_left() {
    let run = run_of("table8.toml");
    let compensation = run.compensation.as_ref().unwrap();
    assert!(compensation.before.mean > 1e-3);
    assert!(compensation.after.mean < 40e-6, "{}", compensation.after.mean);
}
