//! Blind trials of the diagnosis: a robot with something hidden in it is measured, calibrated and diagnosed, and the answer is held
//! against the truth, which the diagnosis never sees.

mod case;
mod designs;
mod tally;
mod trial;

use calibench::assess::Library;
use rayon::prelude::*;

pub use case::{Case, Kind};
pub use designs::{DesignRow, designs};
pub use tally::{Share, Tally, tally};
pub use trial::{Outcome, TrialError};

use crate::random::Streams;
use crate::run::Plans;
use crate::scenario::{Scenario, SuiteToml};

/// Everything that a suite hides, in its order.
pub fn cases(scenario: &Scenario, spec: &SuiteToml) -> Vec<Case> {
    let cell = scenario.dataset();
    let library = Library::of_robot(&cell, &scenario.model);
    case::all(&library, &cell, spec)
}

/// Runs the cases `first..first + count` of a suite, each on its own streams; `done` is told of each.
///
/// # Errors
/// The first that a trial meets, in the order of the cases.
pub fn run(
    scenario: &Scenario,
    plans: &Plans,
    cases: &[Case],
    seed: u64,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Outcome>, TrialError> {
    let one = |(number, case): (usize, &Case)| {
        let outcome = trial::trial(scenario, plans, case, Streams { seed, trial: number as u64 });
        done();
        outcome
    };
    cases.par_iter().enumerate().map(one).collect()
}
