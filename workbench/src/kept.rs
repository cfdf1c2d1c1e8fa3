//! Results for sets of effects, kept so that switching back is immediate.

use std::sync::Arc;

use calibench::identify::Model;
use calibench::planning::Proposal;
use calibench::selection::recommend::Gain;
use calibench::selection::{FitScores, FittedModel};
use serde_json::Value;

use calibench_report::{PageModel, Views};

/// Number of samples, over all kept sets, beyond which the set that was not used for the longest time is dropped: a set
/// needs about 1.5 kB a sample.
const MOST_SAMPLES: usize = 150_000;

/// Number of sets kept at least, and at most.
const SETS: [usize; 2] = [4, 200];

/// A fitted set of effects on chosen data, and what else was computed for it.
pub(super) struct CachedFit {
    /// Datasets, by index.
    pub chosen: Vec<usize>,
    /// The scores of the fit, with its model.
    pub scores: Arc<FitScores>,
    /// The figures of the fit, as a step of the ladder names them.
    pub figures: Value,
    /// The fit, until it is judged.
    pub fitted: Option<FittedModel>,
    /// The judged model, or why it cannot be judged.
    pub judged: Option<Result<Arc<PageModel>, String>>,
    /// The samples, once looked at, or why they cannot be.
    pub views: Option<Result<Views, String>>,
    /// Candidates that cannot be fitted, and why.
    pub not_fitted: Vec<(String, String)>,
    /// Gains over the sets from which this one was reached.
    pub gains: Vec<(Model, Vec<Gain>)>,
    /// The next measurements, once requested.
    pub proposal: Option<Arc<Proposal>>,
    used: u64,
}

impl CachedFit {
    /// A fitted set of which no more is known.
    pub fn new(chosen: Vec<usize>, fitted: FittedModel, figures: Value) -> Self {
        CachedFit {
            chosen,
            scores: fitted.scores.clone(),
            figures,
            fitted: Some(fitted),
            judged: None,
            views: None,
            not_fitted: Vec::new(),
            gains: Vec::new(),
            proposal: None,
            used: 0,
        }
    }

    /// True if it is this model on these data.
    pub fn is(&self, chosen: &[usize], model: &Model) -> bool {
        self.chosen == chosen && self.scores.model == *model
    }

    /// The judged model.
    pub fn page_model(&self) -> Option<&Arc<PageModel>> {
        self.judged.as_ref().and_then(|j| j.as_ref().ok())
    }

    /// The gains over another model, if they were computed.
    pub fn gains_over(&self, before: &Model) -> Option<&Vec<Gain>> {
        self.gains.iter().find(|(model, _)| model == before).map(|(_, gains)| gains)
    }

    /// True if a candidate was fitted, or cannot be.
    pub fn has_tried(&self, effect: &str) -> bool {
        let fitted = self.views.as_ref().and_then(|v| v.as_ref().ok()).is_some_and(|v| v.has(effect));
        fitted || self.not_fitted.iter().any(|(e, _)| e == effect)
    }
}

/// The kept sets.
#[derive(Default)]
pub(super) struct FitCache {
    sets: Vec<CachedFit>,
    clock: u64,
}

impl FitCache {
    /// The set of this model on these data.
    pub fn find(&self, chosen: &[usize], model: &Model) -> Option<&CachedFit> {
        self.sets.iter().find(|s| s.is(chosen, model))
    }

    /// The same, to be added to.
    pub fn find_mut(&mut self, chosen: &[usize], model: &Model) -> Option<&mut CachedFit> {
        self.clock += 1;
        let clock = self.clock;
        let set = self.sets.iter_mut().find(|s| s.is(chosen, model))?;
        set.used = clock;
        Some(set)
    }

    /// Keeps a set, and drops those that were not used for the longest time if there are too many.
    pub fn keep(&mut self, set: CachedFit) {
        self.clock += 1;
        self.sets.retain(|s| !s.is(&set.chosen, &set.scores.model));
        self.sets.push(CachedFit { used: self.clock, ..set });
        let is_too_many = |sets: &[CachedFit]| {
            let samples: usize = sets.iter().map(|s| s.scores.blocks.len()).sum();
            sets.len() > SETS[1] || sets.len() > SETS[0] && samples > MOST_SAMPLES
        };
        while is_too_many(&self.sets) {
            let oldest = (0..self.sets.len()).min_by_key(|&k| self.sets[k].used).unwrap_or_default();
            self.sets.remove(oldest);
        }
    }
}
