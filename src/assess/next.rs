//! What to measure next: which extra measurements tell the rivals of a diagnosis apart, or lower the error predicted over the workspace.
//!
//! Every rival has its own joint state of knowledge, and predicts what a further measurement would show. Measurements are chosen one
//! after the other where the predictions differ most beside their uncertainty, each with regard to what those before would have
//! taught every rival (sequential discrimination of models: Box & Hill 1967; the bound on the error of a decision:
//! Bhattacharyya). To determine a model better is another thing, and tells rivals apart no better than chance does.

mod action;
mod candidate_covariances;
mod criterion;
mod designer;
mod forecast;
mod layout;
mod length;
mod planned;
mod pool;
mod prospect;
mod rival;
mod rivalry;

pub use action::{Action, Kind, NotOffered, actions};
pub use criterion::Criterion;
pub use designer::Designer;
pub use forecast::Forecast;
pub use layout::CellLayout;
pub use planned::{Planned, planned_for};
pub use pool::Pool;
pub use prospect::Prospect;
pub use rival::Rival;

use rayon::prelude::*;

use super::diagnosis::Diagnosis;
use super::examination::Examination;
use super::relevance::Relevance;
use crate::identify::IdentifyError;
use crate::measure::Dataset;

/// Numbers of measurements that are compared.
pub const STEPS: [usize; 3] = [5, 10, 20];

/// A chance to resolve so much lower, or an error larger by this share, is as good where it takes less time.
const AS_GOOD_CHANCE: f64 = 0.03;
const AS_GOOD_ERROR: f64 = 0.05;

/// Rivals whose shape is the side from which joints arrive.
const OF_SIDES: &str = "hysteresis";

/// What comes of one action with so many measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Number of measurements.
    pub count: usize,
    /// How well the effect will be named; `None` without two rivals.
    pub outlook: Option<Forecast>,
    /// Error expected over the workspace, the whole library fitted, mean, m; `None` when no workspace was named.
    pub error: Option<f64>,
}

/// An action with what is to be expected of it.
#[derive(Debug, Clone)]
pub struct Offer {
    /// The action.
    pub action: Action,
    /// The measurements chosen of its pool, in order.
    pub chosen: Vec<usize>,
    /// What comes of the first 5, 10, 20; of those that there are.
    pub steps: Vec<Step>,
}

/// What could be measured next, side by side.
#[derive(Debug, Clone)]
pub struct Proposal {
    /// Rivals with their probabilities; fewer than two when there is nothing to tell apart.
    pub rivals: Vec<Rival>,
    /// By what measurements were chosen.
    pub criterion: Criterion,
    /// As things stand.
    pub now: Step,
    /// Action by action.
    pub offers: Vec<Offer>,
    /// What could not be offered.
    pub not_offered: Vec<NotOffered>,
}

/// Compares what could be measured next: by what tells the rivals of the diagnosis apart, or, where there are none, by what lowers the
/// error expected at joint angles `poses` (rad, N).
///
/// # Errors
/// When data and model do not go together.
pub fn propose(
    datasets: &[(&str, &Dataset)],
    examination: &Examination,
    diagnosis: &Diagnosis,
    relevance: &Relevance,
    layout: &CellLayout,
    poses: &[Vec<f64>],
    seed: u64,
) -> Result<Proposal, IdentifyError> {
    let rivals = Rival::of(diagnosis, 1);
    let designer = Designer::new(datasets, examination, &rivals)?.with_workspace(datasets, relevance, poses)?;
    let criterion = if designer.has_rivals() { Criterion::Discrimination } else { Criterion::Accuracy };
    let needs_sides = examination.library().candidates.iter().any(|c| c.family == OF_SIDES)
        || rivals.iter().any(|r| r.effect.starts_with(OF_SIDES));
    let (actions, not_offered) = match datasets.first() {
        Some((_, first)) => actions(first, examination, layout, needs_sides, seed),
        None => (Vec::new(), Vec::new()),
    };
    let most = STEPS[STEPS.len() - 1];
    let offer = |action: Action| -> Result<Offer, IdentifyError> {
        let prospect = designer.before(&action.pool);
        let chosen = prospect.choose(criterion, most)?;
        let counts: Vec<usize> = STEPS.iter().copied().filter(|&count| count <= chosen.len()).collect();
        let errors = prospect.errors_after(&chosen, &counts)?;
        let step = |(k, &count): (usize, &usize)| -> Result<Step, IdentifyError> {
            Ok(Step { count, outlook: prospect.outlook(&chosen[..count])?, error: errors.get(k).copied() })
        };
        let steps = counts.iter().enumerate().map(step).collect::<Result<_, _>>()?;
        Ok(Offer { chosen, steps, action })
    };
    let offers = actions.into_par_iter().map(offer).collect::<Result<_, _>>()?;
    let now = Step { count: 0, outlook: designer.now(), error: designer.error_now() };
    Ok(Proposal { rivals, criterion, now, offers, not_offered })
}

impl Proposal {
    /// How good a step is by the criterion: larger is better.
    pub fn merit(&self, step: &Step) -> f64 {
        match (self.criterion, step.outlook) {
            (Criterion::Discrimination, Some(outlook)) => outlook.resolved,
            _ => -step.error.unwrap_or(f64::INFINITY),
        }
    }

    /// The best step of those offers that `counts` takes, with its offer: of those that are as good as the best, the quickest.
    pub fn best(&self, counts: impl Fn(&Offer) -> bool) -> Option<(&Offer, &Step)> {
        let all = || self.offers.iter().filter(|o| counts(o)).flat_map(|o| o.steps.iter().map(move |s| (o, s)));
        let best = all().map(|(_, s)| self.merit(s)).reduce(f64::max)?;
        let least =
            if self.criterion == Criterion::Discrimination { best - AS_GOOD_CHANCE } else { best * (1.0 + AS_GOOD_ERROR) };
        let duration = |(offer, step): &(&Offer, &Step)| offer.action.duration(step.count);
        all().filter(|(_, s)| self.merit(s) >= least).min_by(|a, b| duration(a).total_cmp(&duration(b)))
    }
}
