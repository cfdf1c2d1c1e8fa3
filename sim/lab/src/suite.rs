//! Blind trials of the diagnosis: a robot with a hidden effect is measured, calibrated and diagnosed, and the answer is
//! compared with the ground truth, which the diagnosis never sees.

mod advice;
mod answer;
mod case;
mod classes;
mod designs;
mod hide;
mod outcome;
mod reliability;
mod tally;
mod text;
mod trial;

use calibench::diagnosis::library::Library;
use calibench::files::FileError;
use rayon::prelude::*;

pub use advice::Advice;
pub use case::{Case, Condition, Kind};
pub use classes::{ClassRow, class_rows};
pub use designs::{DesignRow, designs};
pub use hide::HideError;
pub use outcome::Outcome;
pub use reliability::{Reliability, reliability};
pub(crate) use tally::quantile;
pub use tally::{Share, Tally, tally};
pub use text::{classes_text, reliability_text, suite_text};
pub use trial::TrialError;

use calibench_sim::planning::PlanError;
use calibench_sim::plans::Plans;
use calibench_sim::scenario::{Scenario, SuiteToml, load_scenario};

/// Seeds below this are for development; reported results use others.
pub const FIRST_REPORTING_SEED: u64 = 1001;

/// The cells of a suite: its own, its own with few samples, and those of other robots.
pub struct Suite {
    cells: Vec<Scenario>,
    cases: Vec<Case>,
}

/// A cell of a suite that cannot be planned.
#[derive(Debug)]
pub struct Unplanned {
    /// The error, with a remedy if its scenario states one.
    pub error: FileError,
}

/// A suite with planned poses.
pub struct Planned<'a> {
    suite: &'a Suite,
    plans: Vec<Option<Plans>>,
    seed: u64,
}

impl Suite {
    /// Reads the suite of a scenario.
    ///
    /// # Errors
    /// If a number of the suite is out of bounds, or a scenario of another robot cannot be read.
    pub fn new(scenario: &Scenario, spec: &SuiteToml) -> Result<Self, FileError> {
        check(scenario, spec)?;
        let balls = scenario.ball_ids().len();
        let mut few = scenario.clone();
        few.plan.poses_per_ball = spec.few_samples.div_ceil(balls);
        let mut cells = vec![scenario.clone(), few];
        for (k, file) in spec.robots.iter().enumerate() {
            let key = format!("suite.robots[{k}]");
            let problem = |e: FileError| scenario.wrong(&key, format!("'{file}': {e}"), "name a scenario that can be run");
            let mut cell = load_scenario(&scenario.suite_folder().join(file)).map_err(problem)?;
            cell.mujoco = scenario.mujoco;
            cells.push(cell);
        }
        let robots: Vec<(String, Vec<String>)> =
            cells[2..].iter().map(|cell| (cell.robot().name.clone(), effects_of(cell))).collect();
        let cases = case::all(&effects_of(scenario), &robots, spec);
        Ok(Suite { cells, cases })
    }

    /// All its cases, in order.
    pub fn cases(&self) -> &[Case] {
        &self.cases
    }

    /// Names of its classes, in order.
    pub fn classes(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.cases.iter().map(|c| c.class.as_str()).collect();
        names.dedup();
        names
    }

    /// Index of the cell in which a case is tried.
    fn place(case: &Case) -> usize {
        match case.condition {
            Condition::Few { .. } => 1,
            Condition::Robot { place } => 2 + place,
            _ => 0,
        }
    }

    /// Chooses the poses of every cell that these cases need.
    ///
    /// # Errors
    /// When a cell has no plan.
    pub fn plan(&self, cases: &[Case], seed: u64) -> Result<Planned<'_>, Unplanned> {
        let plan = |(place, cell): (usize, &Scenario)| {
            let needed = cases.iter().any(|c| Suite::place(c) == place);
            let unplanned = |e: PlanError| Unplanned { error: cell.locate_plan(&e) };
            needed.then(|| Plans::new(cell, seed).map_err(unplanned)).transpose()
        };
        let plans = self.cells.iter().enumerate().map(plan).collect::<Result<_, _>>()?;
        Ok(Planned { suite: self, plans, seed })
    }
}

impl Planned<'_> {
    /// Runs these cases, each on its own streams; `done` is called after each.
    ///
    /// # Errors
    /// The first error of a trial, in the order of the cases.
    pub fn run(&self, cases: &[Case], advice: Advice, done: &(dyn Fn() + Sync)) -> Result<Vec<Outcome>, TrialError> {
        let one = |case: &Case| {
            let place = Suite::place(case);
            let Some(plans) = &self.plans[place] else { return Err(TrialError::Unplanned) };
            let outcome = trial::trial(&self.suite.cells[place], plans, case, self.seed, advice);
            done();
            outcome
        };
        cases.par_iter().map(one).collect()
    }
}

/// Largest accepted number of trials of one kind.
const MOST_TRIALS: usize = 10_000;

/// Checks that the numbers of a suite are within bounds.
fn check(scenario: &Scenario, spec: &SuiteToml) -> Result<(), FileError> {
    for (key, value) in [
        ("trials_per_effect", spec.trials_per_effect),
        ("trials_of_nothing", spec.trials_of_nothing),
        ("trials_of_clutter", spec.trials_of_clutter),
        ("trials_of_dense", spec.trials_of_dense),
        ("trials_of_two", spec.trials_of_two),
        ("trials_of_unknown", spec.trials_of_unknown),
        ("trials_of_outliers", spec.trials_of_outliers),
        ("trials_of_moved_ball", spec.trials_of_moved_ball),
        ("trials_of_understated", spec.trials_of_understated),
        ("trials_of_quantised", spec.trials_of_quantised),
        ("trials_of_few", spec.trials_of_few),
        ("trials_of_robot", spec.trials_of_robot),
    ] {
        if value > MOST_TRIALS {
            let remedy = format!("give a whole number up to {MOST_TRIALS}");
            return Err(scenario.wrong(&format!("suite.{key}"), format!("is {value}"), remedy));
        }
    }
    for (key, value) in [
        ("noise_wrong", spec.noise_wrong),
        ("noise_understated", spec.noise_understated),
        ("quantised_deg", spec.quantised_deg),
    ] {
        if value <= 0.0 {
            return Err(scenario.wrong(&format!("suite.{key}"), format!("is {value}"), "give a positive number"));
        }
    }
    let balls = scenario.ball_ids().len();
    if spec.few_samples < balls {
        let remedy = format!("give at least {balls}, one for each ball");
        return Err(scenario.wrong("suite.few_samples", format!("is {}", spec.few_samples), remedy));
    }
    Ok(())
}

/// Ids of all effects that may be hidden in a cell's robot.
fn effects_of(cell: &Scenario) -> Vec<String> {
    let dataset = cell.dataset();
    let library = Library::of_robot(&dataset, &cell.model);
    case::with_scanned(library.candidates.into_iter().map(|c| c.id.into()).collect(), dataset.robot.joints())
}
