//! State that changes as the user acts.

use std::sync::Arc;

use calibench::prediction::WorkspacePoses;
use serde_json::{Value, json};

use crate::history::{History, Moment};
use crate::kept::{CachedFit, FitCache};
use calibench_report::objection_sentence;

/// Number of candidates that are fitted before they are requested: those that the page lists.
const LISTED: usize = 8;

/// State that changes as the user acts.
pub(super) struct State {
    pub history: History,
    pub kept: FitCache,
    /// Poses at which models of chosen data are judged.
    pub poses: Vec<(Vec<usize>, Arc<WorkspacePoses>)>,
    /// The candidate that someone waits for.
    pub wanted: Option<String>,
}

impl State {
    /// Results for the current set.
    pub fn set(&self) -> Option<&CachedFit> {
        let here = self.history.here();
        self.kept.find(&here.chosen, &here.model)
    }

    /// Results for a moment's set, to be added to.
    pub fn set_mut(&mut self, of: &Moment) -> Option<&mut CachedFit> {
        self.kept.find_mut(&of.chosen, &of.model)
    }

    /// The steps taken, as the page shows them.
    pub fn ladder(&self) -> Value {
        let here = self.history.here();
        let objections: Vec<String> = here.objections.iter().map(objection_sentence).collect();
        let [added, _] = &here.changed;
        let step = (!added.is_empty()).then(|| json!({"effect": added.join(" + "), "objections": objections}));
        json!({"rungs": self.history.rungs(), "complete": true, "step": step})
    }
}

/// The candidates of a set that the page lists.
pub(super) fn listed(set: &CachedFit) -> Vec<String> {
    set.page_model().map_or_else(Vec::new, |p| p.candidates().into_iter().take(LISTED).collect())
}
