//! Choice of the next measurements: those that best distinguish the rival effects of a diagnosis, or that most reduce
//! the error expected over the workspace.
//!
//! Every rival has its own joint posterior and predicts the outcome of further measurements. Measurements are chosen
//! one at a time, where the predictions differ most relative to their uncertainty, after every rival has been updated
//! with those already chosen (sequential discrimination of models: Box & Hill 1967; the bound on the error of a
//! decision: Bhattacharyya). A design that only determines one model better distinguishes rivals no better than chance.

mod action;
mod adaptive;
pub mod aim;
mod candidate_covariances;
pub mod designer;
pub mod forecast;
mod layout;
mod length;
pub mod planned;
pub mod pool;
mod prospect;
mod rival;
mod rivalry;

use self::designer::Criterion;
use self::designer::Designer;
use self::forecast::Forecast;
use self::pool::CellLayout;
use self::rival::Rival;
pub use action::{Action, Kind, NotOffered, actions};
pub use adaptive::{Adaptive, LOOKS, Reached};

use rayon::prelude::*;

use super::diagnosis::Diagnosis;
use crate::diagnosis::Examination;
use crate::effects::facts::Follows;
use crate::effects::registry::Registry;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::prediction::{WORKSPACE_POSES, workspace_poses};

/// Numbers of measurements that are compared.
pub const STEPS: [usize; 3] = [5, 10, 20];

/// Difference of the probability to resolve within which the quicker of two options is preferred.
const AS_GOOD_CHANCE: f64 = 0.03;
/// The same for the error, as a relative difference.
const AS_GOOD_ERROR: f64 = 0.05;

/// Expected outcome of one action with a given number of measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Number of measurements.
    pub count: usize,
    /// Forecast of how well the effect will be named; `None` with fewer than two rivals.
    pub forecast: Option<Forecast>,
    /// Mean error expected over the workspace with the whole library fitted, m; `None` if no workspace was given.
    pub error: Option<f64>,
}

/// An action with its expected outcome.
#[derive(Debug, Clone)]
pub struct Offer {
    /// The action.
    pub action: Action,
    /// The measurements chosen from its pool, in order.
    pub chosen: Vec<usize>,
    /// Expected outcome of the first 5, 10 and 20 measurements; fewer entries if fewer measurements were chosen.
    pub steps: Vec<Step>,
}

/// Comparison of the possible next measurements.
#[derive(Debug, Clone)]
pub struct Proposal {
    /// Rivals with their probabilities; fewer than two if there is nothing to distinguish.
    pub rivals: Vec<Rival>,
    /// The criterion by which measurements were chosen.
    pub criterion: Criterion,
    /// The present state, without further measurements.
    pub now: Step,
    /// One entry per action.
    pub offers: Vec<Offer>,
    /// Actions that could not be offered, with the reason.
    pub not_offered: Vec<NotOffered>,
    /// The families to which the rivals belong.
    pub registry: Registry,
}

/// Compares possible next measurements: by how well they distinguish the rivals of the diagnosis or, with fewer than
/// two rivals, by how much they reduce the error expected over the workspace. `seed` is the seed of the candidate
/// postures.
///
/// # Errors
/// When the data do not fit the model.
pub fn propose(
    datasets: &[NamedDataset<'_>],
    examination: &Examination,
    diagnosis: &Diagnosis,
    layout: &CellLayout,
    seed: u64,
) -> Result<Proposal, IdentifyError> {
    let rivals = Rival::of(diagnosis, 1);
    let poses =
        datasets.first().map_or_else(Vec::new, |NamedDataset { dataset: first, .. }| workspace_poses(first, WORKSPACE_POSES));
    let designer = Designer::new(datasets, examination, &rivals)?.with_workspace(datasets, &diagnosis.relevance, &poses)?;
    let criterion = if designer.has_rivals() { Criterion::Discrimination } else { Criterion::Accuracy };
    let of_sides = |id: &str| examination.model().family(id).is_some_and(|f| f.follows.contains(&Follows::Approach));
    let needs_sides =
        examination.library().candidates.iter().any(|c| of_sides(&c.id)) || rivals.iter().any(|r| of_sides(&r.effect));
    let (actions, not_offered) = match datasets.first() {
        Some(NamedDataset { dataset: first, .. }) => actions(first, examination, layout, needs_sides, seed),
        None => (Vec::new(), Vec::new()),
    };
    let most = STEPS[STEPS.len() - 1];
    let offer = |action: Action| -> Result<Offer, IdentifyError> {
        let prospect = designer.before(&action.pool);
        let chosen = prospect.choose(criterion, most)?;
        let counts: Vec<usize> = STEPS.iter().copied().filter(|&count| count <= chosen.len()).collect();
        let errors = prospect.errors_after(&chosen, &counts)?;
        let step = |(k, &count): (usize, &usize)| -> Result<Step, IdentifyError> {
            Ok(Step { count, forecast: prospect.forecast(&chosen[..count])?, error: errors.get(k).copied() })
        };
        let steps = counts.iter().enumerate().map(step).collect::<Result<_, _>>()?;
        Ok(Offer { chosen, steps, action })
    };
    let offers = actions.into_par_iter().map(offer).collect::<Result<_, _>>()?;
    let now = Step { count: 0, forecast: designer.now(), error: designer.error_now() };
    Ok(Proposal { rivals, criterion, now, offers, not_offered, registry: diagnosis.registry.clone() })
}

impl Proposal {
    /// Merit of a step by the criterion: larger is better.
    pub fn merit(&self, step: &Step) -> f64 {
        match (self.criterion, step.forecast) {
            (Criterion::Discrimination, Some(forecast)) => forecast.resolved,
            _ => -step.error.unwrap_or(f64::INFINITY),
        }
    }

    /// The best step among the offers that `counts` selects, with its offer: the quickest of those that are about as
    /// good as the best.
    pub fn best(&self, counts: impl Fn(&Offer) -> bool) -> Option<(&Offer, &Step)> {
        let all = || self.offers.iter().filter(|o| counts(o)).flat_map(|o| o.steps.iter().map(move |s| (o, s)));
        let best = all().map(|(_, s)| self.merit(s)).reduce(f64::max)?;
        let least =
            if self.criterion == Criterion::Discrimination { best - AS_GOOD_CHANCE } else { best * (1.0 + AS_GOOD_ERROR) };
        let duration = |(offer, step): &(&Offer, &Step)| offer.action.duration(step.count);
        all().filter(|(_, s)| self.merit(s) >= least).min_by(|a, b| duration(a).total_cmp(&duration(b)))
    }
}
