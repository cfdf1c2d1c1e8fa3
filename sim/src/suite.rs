//! Blind trials of the diagnosis: a robot with something hidden in it is measured, calibrated and diagnosed, and the answer is held
//! against the truth, which the diagnosis never sees.

mod case;
mod designs;
mod tally;
mod trial;

use calibench::assess::Library;
use rayon::prelude::*;
use serde::Deserialize;

pub use case::{Case, Kind};
pub use designs::{DesignRow, designs};
pub use tally::{Share, Tally, tally};
pub use trial::{Outcome, TrialError};

use crate::random::Streams;
use crate::run::Plans;
use crate::scenario::Scenario;

/// The keys under `[suite]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // described in docs/scenarios.md
pub struct SuiteToml {
    /// Sizes of a single hidden effect, in plausible sizes.
    pub sizes: Vec<f64>,
    /// Trials of each effect and size.
    pub trials_per_effect: usize,
    /// Trials with nothing hidden; as many more with the noise stated too small.
    pub trials_of_nothing: usize,
    /// By how much the noise is then stated too small.
    pub noise_wrong: f64,
    /// Sizes of clutter, in plausible sizes, and trials of each.
    pub clutter: Vec<f64>,
    pub trials_of_clutter: usize,
    /// Trials with every effect at once at sizes of every order.
    pub trials_of_dense: usize,
    /// Trials with two effects at once, at twice their plausible size.
    pub trials_of_two: usize,
    /// Sizes of the flaws that no catalogue holds, in plausible sizes, and trials of each.
    pub unknown_sizes: Vec<f64>,
    pub trials_of_unknown: usize,
}

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
