//! Monte-Carlo studies: a scenario, at one point or several, carried out repeatedly with every error sampled again.
//!
//! A trial is the whole procedure: mastering, probing, identification, validation, by TriCal, by tracker or by both. Trial `k` of a
//! point uses stream `k` of the scenario's seed, independent of machine, thread and other trials; all points share the streams,
//! so that two points differ by their settings and not by chance (common random numbers). Poses are planned once per point.

mod axis;
mod bands;
mod distribution;
mod extent;
mod merge;
mod page;
#[cfg_attr(not(feature = "parquet"), path = "study/without_parquet.rs")]
mod parquet;
mod rare;
mod rows;
mod rows_file;
mod run;
mod summary;
mod sweep;
mod tail;
mod text;
mod trial;

use std::sync::Arc;

use calibench::files::FileError;
use calibench::identify::problem::{Prior, Problem, Use};
use calibench::measure::dataset::NamedDataset;
use calibench::measure::poses::PlannedPose;
use calibench::robot::robot_file::to_toml;
use sha2::{Digest, Sha256};

pub use bands::{Share, quantile_band};
pub use distribution::Distribution;
pub use extent::Extent;
pub use merge::{Merged, merge};
pub use page::study_page;
pub use parquet::{expect_parquet, write_parquet};
pub use rows::Columns;
pub use rows_file::{RowsFile, RowsReader};
pub use run::run;
pub use summary::{MethodSummary, PERCENT, PointSummary, Quantile, Spread, Summary};
pub use sweep::{SweepPoint, sweep_points};
pub use tail::{Tail, TailQuantile};
pub use text::{study_json, study_text};

use rare::tilt;

use calibench_sim::plans::Plans;
use calibench_sim::run::Methods;
use calibench_sim::scenario::{Document, Scenario};

/// Keys without influence on the planned poses; all others count.
const NOT_PLANNED_BY: [&str; 10] =
    ["name", "question", "plant", "truth", "centring", "expect", "suite", "sweep", "design", "format"];

/// A study ready to run.
pub struct Study {
    /// Name and fingerprint of everything its numbers depend on: the scenario, its sweep, the options, the program version.
    pub id: String,
    /// Columns of its table.
    pub columns: Columns,
    /// Its points, at least one.
    pub points: Vec<Point>,
    /// The methods of which every trial has a row.
    pub methods: Methods,
    /// True if every trial is diagnosed.
    pub diagnosed: bool,
}

/// One point of a study.
pub struct Point {
    /// The scenario at this point.
    pub scenario: Scenario,
    /// Its label on each axis.
    pub at: Vec<String>,
    /// Its poses, or the reason for having none.
    pub plans: Result<Arc<Plans>, String>,
}

impl Study {
    /// Reads a study and plans its points; `begun(point, of)` is called for each. Points with equal inputs to planning share a
    /// plan.
    ///
    /// # Errors
    /// If the scenario is invalid at some point, or no point can be planned.
    pub fn new(
        document: &Document,
        methods: Methods,
        diagnosed: bool,
        begun: &dyn Fn(usize, usize),
    ) -> Result<Self, FileError> {
        let base = document.scenario()?;
        let (axes, places) = sweep_points(document, base.sweep.as_ref())?;
        let mut scenarios = Vec::with_capacity(places.len());
        for place in &places {
            let scenario = place.document.scenario().map_err(|e| {
                let at: Vec<String> = axes.iter().zip(&place.at).map(|(axis, value)| format!("{axis} = {value}")).collect();
                if at.is_empty() {
                    e
                } else {
                    document.wrong("sweep", format!("at {}: {}: {}", at.join(", "), e.field, e.problem), e.remedy)
                }
            })?;
            scenarios.push(scenario);
        }
        let mut planned: Vec<(String, Result<Arc<Plans>, String>)> = Vec::new();
        let mut points: Vec<Point> = Vec::with_capacity(places.len());
        let mut first_failure = None;
        for (k, (place, scenario)) in places.into_iter().zip(scenarios).enumerate() {
            begun(k, planned.len());
            let of = place.document.text_without(&NOT_PLANNED_BY);
            let plans = match planned.iter().find(|(other, _)| *other == of) {
                Some((_, plans)) => plans.clone(),
                None => {
                    let plans = Plans::new(&scenario, scenario.seed).map(Arc::new).map_err(|e| {
                        let located = scenario.locate_plan(&e);
                        let reason = format!("no plan: {}", located.problem);
                        first_failure.get_or_insert(located);
                        reason
                    });
                    planned.push((of, plans.clone()));
                    plans
                }
            };
            points.push(Point { scenario, at: place.at, plans });
        }
        // A point of a sweep may be unreachable; if all are, the scenario is wrong.
        if let Some(failure) = first_failure.filter(|_| points.iter().all(|p| p.plans.is_err())) {
            return Err(failure);
        }
        let id = identity(document, &base, methods, diagnosed);
        let columns = Columns::new(&axes, methods, diagnosed, &parameters(&points));
        Ok(Study { id, columns, points, methods, diagnosed })
    }

    /// The same study of rare robots: those with errors that `share` of the robots stay below are drawn often, and every trial
    /// has a weight that makes up for it.
    ///
    /// # Errors
    /// If the scenario draws no errors of the robot.
    pub fn of_rare(mut self, share: f64) -> Result<Self, FileError> {
        for point in &mut self.points {
            let Ok(plans) = &point.plans else { continue };
            let tilt = tilt(&point.scenario, plans, self.methods, share).map_err(|problem| {
                let remedy = "state `draw` for the effects in which robots differ, or leave out --rare";
                point.scenario.wrong("truth.effects", problem, remedy)
            })?;
            point.scenario = point.scenario.tilted(tilt);
        }
        self.columns = self.columns.weighted(share);
        self.id = format!("{}-rare-{share}", self.id);
        Ok(self)
    }
}

fn identity(document: &Document, base: &Scenario, methods: Methods, diagnosed: bool) -> String {
    let mut hash = Sha256::new();
    hash.update(document.text_without(&["question", "expect", "suite", "design"]));
    hash.update(to_toml(base.robot()));
    hash.update(format!("{} {diagnosed} {}", methods.name(), env!("CARGO_PKG_VERSION")));
    let digits: String = hash.finalize().iter().take(6).map(|byte| format!("{byte:02x}")).collect();
    format!("{}-{digits}", base.name)
}

/// Every parameter that some point may estimate, in the order of the models.
fn parameters(points: &[Point]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for point in points {
        let Ok(plans) = &point.plans else { continue };
        let mut cell = point.scenario.dataset();
        cell.samples = plans.plan.probing.poses.iter().filter_map(PlannedPose::nominal_sample).collect();
        // A model that does not match these data fails in every trial, where it is reported.
        let Ok(problem) = Problem::new(&[NamedDataset::new("plan", &cell)], &point.scenario.model, Use::Fit) else { continue };
        for parameter in problem.parameters().iter().filter(|p| !matches!(p.knowledge, Prior::Certified(_))) {
            if !names.contains(&parameter.name) {
                names.push(parameter.name.clone());
            }
        }
    }
    names
}
