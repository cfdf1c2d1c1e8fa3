//! Background computations for the current set of effects: first its judgement, then its samples, then the curves of its
//! candidates, so that looking at one is a look-up.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;

use calibench::files::with_reasons;
use calibench::identify::calibration::IdentifyError;
use calibench::prediction::WorkspacePoses;
use calibench::selection::FittedModel;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::bench::Bench;
use crate::history::Moment;
use crate::state::{State, listed};
use calibench_report::{FittedCandidate, PageModel, Views};

/// Number of candidates fitted at the same time: a requested candidate waits for these at most.
const TOGETHER: usize = 2;

/// Threads that fit candidates: half of the processors, so that a switch that is turned meanwhile finds the others free.
fn beside() -> Option<ThreadPool> {
    ThreadPoolBuilder::new().num_threads((rayon::current_num_threads() / 2).max(1)).build().ok()
}

/// Something to be computed, with all that it needs.
pub(super) enum Task {
    Judge(Moment, Box<FittedModel>),
    Look(Moment, Arc<PageModel>),
    Candidates(Moment, Arc<PageModel>, Views, Vec<String>),
}

impl State {
    /// The most urgent task, of at most `together` candidates or of what comes before them; `None` if all that is computed.
    pub(super) fn next_task(&mut self, of_candidates: bool, together: usize) -> Option<Task> {
        let here = self.history.here().clone();
        let wanted = self.wanted.clone();
        let set = self.set_mut(&here)?;
        if set.judged.is_none() {
            if of_candidates {
                return None;
            }
            return set.fitted.take().map(|fitted| Task::Judge(here, Box::new(fitted)));
        }
        let page_model = set.page_model()?.clone();
        let views = match &set.views {
            None if of_candidates => return None,
            None => return Some(Task::Look(here, page_model)),
            Some(Ok(views)) if of_candidates => views.clone(),
            Some(_) => return None,
        };
        let ahead = listed(set);
        let all = wanted.iter().chain(&ahead).filter(|effect| !set.has_tried(effect));
        let effects: Vec<String> = all.take(together).cloned().collect();
        (!effects.is_empty()).then_some(Task::Candidates(here, page_model, views, effects))
    }
}

impl Bench {
    /// Computes what there is to compute, for ever. Candidates take seconds on large campaigns, for which the judgement of the
    /// next set does not wait.
    pub fn work(&self) {
        self.worked.store(true, Ordering::Relaxed);
        thread::scope(|scope| {
            scope.spawn(|| match beside() {
                Some(threads) => threads.install(|| self.work_on(true)),
                None => self.work_on(true),
            });
            self.work_on(false);
        });
    }

    fn work_on(&self, of_candidates: bool) {
        loop {
            let mut state = self.state();
            let task = loop {
                match state.next_task(of_candidates, TOGETHER) {
                    Some(task) => break task,
                    None => state = self.wait(state),
                }
            };
            drop(state);
            self.carry_out(task);
        }
    }

    /// Computes one thing.
    pub(super) fn carry_out(&self, task: Task) {
        match task {
            Task::Judge(at, fitted) => self.judge(&at, *fitted),
            Task::Look(at, page_model) => self.look(&at, &page_model),
            Task::Candidates(at, page_model, views, effects) => self.fit_candidates(&at, &page_model, &views, &effects),
        }
        self.notify();
    }

    fn poses(&self, at: &Moment) -> Arc<WorkspacePoses> {
        let known = self.state().poses.iter().find(|(chosen, _)| *chosen == at.chosen).map(|(_, poses)| poses.clone());
        known.unwrap_or_else(|| {
            let poses = self.subject(at, PageModel::poses);
            self.state().poses.push((at.chosen.clone(), poses.clone()));
            poses
        })
    }

    fn judge(&self, at: &Moment, fitted: FittedModel) {
        let judged = computed(|| {
            let poses = self.poses(at);
            self.subject(at, |subject| PageModel::of_fitted(fitted, subject, poses))
        });
        if let Some(set) = self.state().set_mut(at) {
            set.judged = Some(judged.map(Arc::new));
        }
    }

    fn look(&self, at: &Moment, page_model: &PageModel) {
        let views = computed(|| self.subject(at, |subject| Views::new(subject, page_model)));
        if let Some(set) = self.state().set_mut(at) {
            set.views = Some(views);
        }
    }

    fn fit_candidates(&self, at: &Moment, page_model: &PageModel, views: &Views, effects: &[String]) {
        let one = |effect: &String| -> Result<Option<FittedCandidate>, String> {
            computed(|| self.subject(at, |subject| views.fit_candidate(subject, page_model, effect)))
        };
        let fitted: Vec<_> = effects.par_iter().map(one).collect();
        let mut state = self.state();
        let Some(set) = state.set_mut(at) else { return };
        for (effect, result) in effects.iter().zip(fitted) {
            match (result, &mut set.views) {
                (Ok(Some(candidate)), Some(Ok(views))) => views.keep(candidate, page_model),
                (Ok(_), _) => set.not_fitted.push((effect.clone(), format!("'{effect}' is not a candidate of this diagnosis"))),
                (Err(because), _) => set.not_fitted.push((effect.clone(), because)),
            }
        }
    }
}

/// The result, or why there is none.
fn computed<T>(compute: impl FnOnce() -> Result<T, IdentifyError>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(compute)) {
        Ok(result) => result.map_err(|e| with_reasons(&e)),
        Err(_) => Err(panicked()),
    }
}

fn panicked() -> String {
    "this cannot be computed; switch back, or save and open it again".to_owned()
}
