//! Many runs of one robot: what stayed, what moved, and what belongs to one run only.
//!
//! The arm is one, with one set of parameters; every run has its own base, tool and artifact. A difference between runs is a
//! parameter, or an effect as a whole, with another value since some run, in one run only, or in proportion to the time. Each is
//! tested beside everything that the runs share, with what every arm has and no model holds: error curves of all joints of the
//! size that the evidence gives them. Without these, campaigns of different postures would seem to be of different robots, since
//! each bends the parameters to the errors of its own postures.
//!
//! What two joints do together is in no curve. How much it matters is seen within the runs: each is halved in joint space, and the
//! parameters are set free in the halves. Since one robot was measured in both, whatever that explains is due to what the model lacks,
//! and every test between runs is in units of it.
//!
//! The tests are F tests of nested linear models at the fit. The best of all differences is taken if its chance, times their
//! number (Bonferroni), is below half of [`RUNS_FALSE_ALARM`]; then the robot is fitted again with it, in full, and the next one is
//! looked for. The other half is for all parameters at once: whether one geometry explains what remains.

mod base;
mod drift;
mod left_out;
mod look;
mod products;
pub mod tables;
mod units;

use self::tables::EffectInRuns;
use self::tables::EffectStatus;
use self::tables::ParameterInRuns;
use self::tables::RunOfRobot;
pub use drift::Drift;
pub use left_out::LeftOut;
pub use units::Pattern;

use thiserror::Error;

use self::left_out::{changes_shown_by, with_curves};
use self::look::Look;
use self::tables::Tables;
use crate::effects::EffectId;
use crate::identify::calibration::{Calibration, Estimate, IdentifyError};
use crate::identify::problem::Use;
use crate::identify::{Model, RunChange, identify};
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::monitoring::check::copies::in_both;
use crate::residuals::noise::{Suspect, suspects};

/// Probability that runs of a robot in which nothing changed are reported to differ (half of it for each question of
/// docs/runs.md).
pub const RUNS_FALSE_ALARM: f64 = 0.01;

/// Largest number of differences that are named: a robot in which more has changed is another robot (docs/runs.md).
const MOST_CHANGES: usize = 4;

/// Mean length of a month, days.
pub(crate) const DAYS_A_MONTH: f64 = 30.44;

/// Reasons why runs cannot be compared.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunsError {
    /// There is nothing to compare.
    #[error("there is one run only; give at least two")]
    OneRun,
    /// Two runs are the same measurements.
    #[error("{rows} of its rows are also in {first}: the same measurements are not a second run")]
    SameRows {
        /// Name of the run.
        run: String,
        /// Name of the other.
        first: String,
        /// Number of rows.
        rows: usize,
    },
    /// A run has nothing to be fitted to.
    #[error("it has no rows of set `fit`")]
    NoRows {
        /// Name of the run.
        run: String,
    },
    /// Nothing can be said of a run of so few poses.
    #[error("its {rows} rows of set `fit` are too few to say whether it is the same robot; give a run of four at least")]
    FewRows {
        /// Name of the run.
        run: String,
        /// Number of rows.
        rows: usize,
    },
    /// The differences that are allowed between the runs use up nearly all degrees of freedom.
    #[error("the rows of set `fit` leave {spare:.0} numbers to spare beyond what may differ; give runs with more rows")]
    TooFewRows {
        /// Degrees of freedom that are left.
        spare: f64,
    },
    /// A declared drift is of no parameter that was fitted.
    #[error("'{name}' is not a parameter of the arm that these runs determine; there are {known}")]
    NoParameter {
        /// As given.
        name: String,
        /// The parameters.
        known: String,
    },
    /// A drift needs times.
    #[error("a drift needs the date of every run")]
    NoDates,
    /// The data do not fit the model.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// Fewest rows of a run: three compare no more than a base or a tool has degrees of freedom.
const FEWEST_ROWS: usize = 4;

/// A run of a robot.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// Name.
    pub name: &'a str,
    /// Measurements of the run.
    pub dataset: &'a Dataset,
    /// Date, in days since any fixed date.
    pub day: Option<f64>,
}

/// Input of a comparison of runs.
#[derive(Debug, Clone, Copy)]
pub struct RunsQuestion<'a> {
    /// The runs, in the order of time.
    pub runs: &'a [Run<'a>],
    /// The model.
    pub model: &'a Model,
    /// Parameters that may drift, by name, with one sigma of their change in a month, SI.
    pub drifts: &'a [(String, f64)],
    /// True if every run is also predicted by the robot of the others.
    pub left_out: bool,
}

/// A test of differences between runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunsTest {
    /// Ratio of the mean squares.
    pub f: f64,
    /// Its degrees of freedom.
    pub above: f64,
    /// Those of the residuals.
    pub below: f64,
    /// Probability of a larger ratio if nothing differs.
    pub chance: f64,
}

/// A difference between runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Id of the effect.
    pub effect: EffectId,
    /// Its parameters that differ, with the change and its standard uncertainty.
    pub parameters: Vec<Estimate>,
    /// Pattern of the difference over the runs.
    pub pattern: Pattern,
    /// The run of which tool, base or ball are not as stated; `None` if it is the arm.
    pub set_up_of: Option<usize>,
    /// True if it is an effect that the model lacks.
    pub missing: bool,
    /// Its test.
    pub test: RunsTest,
    /// Number of differences that were tried.
    pub tried: usize,
    /// Other differences that these runs cannot tell from it.
    pub aliased: Vec<String>,
}

/// The verdict on the runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunsVerdict {
    /// One geometry explains all runs.
    OneGeometry,
    /// One geometry explains all runs, but for the differences named.
    Changed,
    /// No few differences explain them.
    Several,
}

impl RunsVerdict {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            RunsVerdict::OneGeometry => "one_geometry",
            RunsVerdict::Changed => "one_geometry_with_changes",
            RunsVerdict::Several => "not_one_geometry",
        }
    }
}

/// The runs compared.
#[derive(Debug, Clone)]
pub struct RunsComparison {
    /// The runs, in order.
    pub runs: Vec<RunOfRobot>,
    /// All parameters of the arm free in every run, before any difference is named.
    pub before: RunsTest,
    /// The differences, in the order in which they were found.
    pub differences: Vec<Difference>,
    /// The same test with these differences.
    pub after: RunsTest,
    /// The verdict.
    pub verdict: RunsVerdict,
    /// Every parameter of the arm.
    pub parameters: Vec<ParameterInRuns>,
    /// Every effect of the model beside geometry and compliance.
    pub effects: Vec<EffectInRuns>,
    /// The model that predicts the runs left out best: the one given or that with error curves, without effects that belong to one
    /// run only.
    pub model: Model,
    /// True if that model has error curves.
    pub curves: bool,
    /// Root mean square of the errors at runs left out, over all runs that could be judged, m: of the model given, and with error
    /// curves.
    pub left_out: [Option<f64>; 2],
    /// By how much the mean temperatures of the runs differ, K, if it is as much that an arm shows it, and no effect of the model
    /// depends on it.
    pub warmer: Option<f64>,
}

impl RunsComparison {
    /// Compares the runs.
    ///
    /// # Errors
    /// When there are not two runs, two are the same, one cannot determine its own set-up, or the data do not fit the model.
    pub fn of(question: RunsQuestion<'_>, observer: &mut dyn FnMut(&str)) -> Result<RunsComparison, RunsError> {
        check(&question)?;
        let named: Vec<NamedDataset<'_>> = question.runs.iter().map(|run| NamedDataset::new(run.name, run.dataset)).collect();
        // As everywhere that residuals are judged.
        let mut model = Model { only_weighed_orientations: true, ..question.model.clone() };
        let mut differences: Vec<Difference> = Vec::new();
        observer("fitting one robot to all runs");
        let mut look = Look::at(&named, &model, &question)?;
        let before = look.all_free();
        look.expect_enough(&before)?;
        while differences.len() < MOST_CHANGES {
            let Some(found) = look.best(&named) else { break };
            observer(&format!("{} {}: fitting again", found.effect, found.pattern.words(&names(&named))));
            let mut with = model.clone();
            let unit = &look.units.all[found.unit];
            with.changes.push(unit.change(&found.pattern, &names(&named), &look.months));
            let Ok(next) = Look::at(&named, &with, &question) else { break };
            (model, look) = (with, next);
            differences.push(found.difference);
        }
        for (difference, change) in differences.iter_mut().zip(&model.changes) {
            difference.parameters = look.estimates_of(&change.id());
        }
        let after = look.all_free();
        let verdict = match (differences.len(), after.chance < 0.5 * RUNS_FALSE_ALARM || differences.len() == MOST_CHANGES) {
            (0, false) => RunsVerdict::OneGeometry,
            (_, false) => RunsVerdict::Changed,
            (_, true) => RunsVerdict::Several,
        };
        let tables = Tables { look: &look, named: &named, differences: &differences };
        let parameters = tables.parameters();
        let effects = tables.effects();
        let kept = without_refused(&model, &effects, &names(&named));
        let runs = tables.runs();
        let mut comparison = RunsComparison {
            runs,
            before,
            differences,
            after,
            verdict,
            parameters,
            effects,
            model: kept,
            curves: false,
            left_out: [None; 2],
            warmer: unknown_warmth(&question),
        };
        if question.left_out {
            comparison.leave_out(&named, observer)?;
        }
        Ok(comparison)
    }

    /// Predicts every run by the robot of the others, and takes the model that does so best.
    fn leave_out(&mut self, named: &[NamedDataset<'_>], observer: &mut dyn FnMut(&str)) -> Result<(), RunsError> {
        let mut squares = [[0.0; 2]; 2];
        for (k, run) in self.runs.iter_mut().enumerate() {
            observer(&format!("predicting {} from the others", named[k].name));
            let results = [false, true].map(|curves| left_out::left_out(named, &self.model, k, curves));
            if let [Ok(plain), Ok(curved)] = &results {
                for (sum, errors) in squares.iter_mut().zip([plain, curved]) {
                    sum[0] += errors.rms.powi(2) * errors.samples as f64;
                    sum[1] += errors.samples as f64;
                }
            }
            let [plain, curved] = results.map(|result| result.map_err(|e| e.to_string()));
            run.from_others = Some([plain, curved]);
        }
        self.left_out = squares.map(|[sum, count]| (count > 0.0).then(|| (sum / count).sqrt()));
        self.curves = matches!(self.left_out, [Some(plain), Some(curved)] if curved < plain);
        if self.curves {
            self.model = with_curves(named, &self.model)?;
        }
        Ok(())
    }

    /// The robot as it is in the last run: what the runs share from all of them, what moved at its last value.
    ///
    /// # Errors
    /// When the data do not determine the model.
    pub fn calibration(&self, question: RunsQuestion<'_>) -> Result<Calibration, RunsError> {
        let named: Vec<NamedDataset<'_>> = question.runs.iter().map(|run| NamedDataset::new(run.name, run.dataset)).collect();
        let Some(NamedDataset { name: last, .. }) = named.last() else { return Err(RunsError::OneRun) };
        let model = changes_shown_by(&self.model, &names(&named));
        let model = Model { only_weighed_orientations: question.model.only_weighed_orientations, ..model };
        let calibration = identify(&named, &model)?;
        Ok(tables::as_in(&calibration, last))
    }
}

/// Excludes in every run the samples that disagree with all others of it, and returns them with the names of their runs.
///
/// A single gross error makes its run so noisy that no change is seen in it, or is taken for one. A run that cannot be fitted alone
/// keeps its samples.
pub fn set_suspects_aside(runs: &mut [(String, Dataset)], model: &Model) -> Vec<(String, Suspect)> {
    let mut all = Vec::new();
    for (name, dataset) in runs {
        let Ok(found) = suspects(&[NamedDataset::new(name.as_str(), &*dataset)], model) else { continue };
        dataset.samples.retain(|s| !Use::Fit.takes(s) || found.iter().all(|suspect| suspect.sample != s.id));
        all.extend(found.into_iter().map(|suspect| (name.clone(), suspect)));
    }
    all
}

fn names<'a>(named: &[NamedDataset<'a>]) -> Vec<&'a str> {
    named.iter().map(|d| d.name).collect()
}

/// A model in which an effect that belongs to one run only is no longer of the robot, but of that run.
fn without_refused(model: &Model, effects: &[EffectInRuns], names: &[&str]) -> Model {
    let mut kept = model.clone();
    for effect in effects {
        let EffectStatus::OnlyIn(run) = effect.status else { continue };
        kept = kept.without(&effect.effect);
        kept.changes.retain(|change| change.effect != effect.effect);
        kept.changes.push(RunChange {
            when: Pattern::Only(run).words(names),
            effect: effect.effect.clone(),
            parameters: Vec::new(),
            weights: vec![(names[run].to_owned(), 1.0)],
        });
    }
    kept
}

/// Temperature difference that is reported, K: a metre of arm grows by some ten micrometres per kelvin.
const REPORTED_TEMPERATURE_SPREAD: f64 = 1.0;

/// By how much the mean temperatures of the runs differ, K, if that is much, and no effect of the model depends on them.
fn unknown_warmth(question: &RunsQuestion<'_>) -> Option<f64> {
    let mean = |run: &Run<'_>| {
        let all: Vec<f64> = run.dataset.samples.iter().filter_map(|s| s.temp_c).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    let means: Vec<f64> = question.runs.iter().filter_map(mean).collect();
    let apart = means.iter().copied().fold(f64::MIN, f64::max) - means.iter().copied().fold(f64::MAX, f64::min);
    let is_known = question.model.effects.iter().any(|effect| effect.starts_with("thermal"));
    (apart >= REPORTED_TEMPERATURE_SPREAD && !is_known).then_some(apart)
}

/// Checks that there are runs to be compared.
fn check(question: &RunsQuestion<'_>) -> Result<(), RunsError> {
    let runs = question.runs;
    if runs.len() < 2 {
        return Err(RunsError::OneRun);
    }
    let is_empty = |run: &&Run<'_>| !run.dataset.samples.iter().any(|s| Use::Fit.takes(s));
    if let Some(run) = runs.iter().find(is_empty) {
        return Err(RunsError::NoRows { run: run.name.into() });
    }
    let fitted = |run: &Run<'_>| run.dataset.samples.iter().filter(|s| Use::Fit.takes(s)).count();
    if let Some(run) = runs.iter().find(|run| fitted(run) < FEWEST_ROWS) {
        return Err(RunsError::FewRows { run: run.name.into(), rows: fitted(run) });
    }
    if !question.drifts.is_empty() && runs.iter().any(|run| run.day.is_none()) {
        return Err(RunsError::NoDates);
    }
    let key = |sample: &crate::measure::dataset::Sample| sample.numbers().map(f64::to_bits).collect::<Vec<u64>>();
    let rows: Vec<std::collections::HashSet<Vec<u64>>> =
        runs.iter().map(|run| run.dataset.samples.iter().map(key).collect()).collect();
    for (k, run) in runs.iter().enumerate() {
        for (j, first) in runs[..k].iter().enumerate() {
            if let Some(rows) = in_both([&rows[k], &rows[j]], [rows[k].len(), rows[j].len()]) {
                return Err(RunsError::SameRows { run: run.name.into(), first: first.name.into(), rows });
            }
        }
    }
    Ok(())
}
