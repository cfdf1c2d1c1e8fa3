//! The bench: the opened data, the user's place in the history, and the answers about it.
//!
//! A switch is answered with the figures of its fit; the judgement, the samples and the candidates' curves are computed in
//! the background, for the present set of effects, in this order; where nobody works in the background, whoever waits for
//! something computes it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use calibench::effects::EffectId;
use calibench::identify::Model;
use calibench::identify::calibration::IdentifyError;
use calibench::selection::FittedModel;
use calibench::selection::ladder::LadderStep;
use calibench::selection::recommend::Gain;
use serde_json::{Value, json};

use crate::case::Case;
use crate::history::{History, Moment};
use crate::kept::{CachedFit, FitCache};
use crate::live::live;
use crate::refusal::Refusal;
use crate::saving::Place;
use crate::state::{State, listed};
use crate::switches::Switches;
use calibench_report::{PageModel, PageSubject, Recommended, Views, documents};

/// The opened data, and every set of effects tried on them.
pub struct Bench {
    pub(super) case: Case,
    pub(super) place: Place,
    pub(super) state: Mutex<State>,
    /// Notified whenever something was computed, or is to be.
    changed: Condvar,
    /// Held by an action that leads to another set.
    pub(super) acting: Mutex<()>,
    /// True once somebody computes in the background.
    pub(super) worked: AtomicBool,
    /// Number of ladders that were cancelled by those who waited for them.
    pub(super) cancelled: AtomicU64,
    /// Description of the current computation, for whoever waits for an action.
    doing: Mutex<String>,
    /// Receives the same as it changes.
    told: Box<dyn Fn(&str) + Send + Sync>,
}

/// A judged moment, with what is known of the one before.
pub(super) struct Judged {
    pub moment: Moment,
    pub page_model: Arc<PageModel>,
    /// The model before the last switch, if it was judged too.
    pub before: Option<Arc<PageModel>>,
}

impl Bench {
    /// Fits the initial model.
    ///
    /// # Errors
    /// If data and model do not match, or the data do not determine the unknowns; the data are returned so that the error can
    /// be located.
    pub fn new(case: Case, place: Place) -> Result<Self, (Box<Case>, IdentifyError)> {
        let chosen = (0..case.datasets.len()).collect();
        let first = Moment::new(chosen, Switches::of(case.model.clone()), None);
        let state = State { history: History::new(first.clone()), kept: FitCache::default(), poses: Vec::new(), wanted: None };
        let bench = Bench {
            case,
            place,
            state: Mutex::new(state),
            changed: Condvar::new(),
            acting: Mutex::new(()),
            worked: AtomicBool::new(false),
            cancelled: AtomicU64::new(0),
            doing: Mutex::default(),
            told: Box::new(|_| ()),
        };
        match bench.fit(&first) {
            Ok(()) => {
                bench.arrive(first, |history, first| *history = History::new(first));
                Ok(bench)
            }
            Err(e) => Err((Box::new(bench.case), e)),
        }
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The same bench; `told` receives a line whenever a long action goes on to something else.
    #[must_use]
    pub fn telling(self, told: impl Fn(&str) + Send + Sync + 'static) -> Self {
        Bench { told: Box::new(told), ..self }
    }

    /// Says what is being done.
    pub(super) fn tell(&self, line: &str) {
        line.clone_into(&mut self.doing.lock().unwrap_or_else(PoisonError::into_inner));
        (self.told)(line);
    }

    /// Progress of the current computation.
    pub(super) fn progress(&self) -> Value {
        json!({"doing": *self.doing.lock().unwrap_or_else(PoisonError::into_inner)})
    }

    /// Waits until something was computed.
    pub(super) fn wait<'a>(&'a self, mut state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        if !self.worked.load(Ordering::Relaxed)
            && let Some(task) = state.next_task(false, 1).or_else(|| state.next_task(true, 1))
        {
            drop(state);
            self.carry_out(task);
            return self.state();
        }
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes all who wait.
    pub(super) fn notify(&self) {
        self.changed.notify_all();
    }

    /// The arguments of the commands recommended by the page: those of the terminal as long as nothing was done.
    fn commands(&self, at: &Moment) -> Recommended {
        let mut commands = self.case.commands.clone();
        if at.chosen.len() < self.case.datasets.len() {
            commands.datasets = at.chosen.iter().map(|&k| self.case.datasets[k].0.as_str()).collect::<Vec<_>>().join(" ");
        }
        if !at.switches.are_initial() {
            commands.model = format!(" --model {}", self.place.model().display());
        }
        commands
    }

    /// Calls `tell` with the subject of the page at a moment.
    pub(super) fn subject<T>(&self, at: &Moment, tell: impl FnOnce(&PageSubject<'_>) -> T) -> T {
        self.case.subject(&at.chosen, &at.model, &self.commands(at), tell)
    }

    /// Fits the set of a moment, unless it is kept.
    pub(super) fn fit(&self, at: &Moment) -> Result<(), IdentifyError> {
        if self.state().set_mut(at).is_some() {
            return Ok(());
        }
        let set = self.subject(at, |subject| {
            let fitted = FittedModel::new(subject.datasets, &at.model)?;
            let figures = PageModel::first_figures(&fitted.scores, subject)?;
            Ok::<_, IdentifyError>(CachedFit::new(at.chosen.clone(), fitted, figures))
        })?;
        let mut state = self.state();
        // The present set is never the one that was not used for the longest time.
        let here = state.history.here().clone();
        state.set_mut(&here);
        state.kept.keep(set);
        Ok(())
    }

    /// Puts a fitted moment into the history.
    pub(super) fn arrive(&self, mut moment: Moment, into: impl FnOnce(&mut History, Moment)) {
        let mut state = self.state();
        let figures = state.set_mut(&moment).map(|set| set.figures.clone()).unwrap_or_default();
        moment.rung = moment.first_rung(&figures);
        into(&mut state.history, moment);
        state.wanted = None;
        drop(state);
        self.notify();
    }

    /// The present moment, once it is judged.
    pub(super) fn judged(&self) -> Result<Judged, Refusal> {
        let mut state = self.state();
        loop {
            match state.set().and_then(|set| set.judged.as_ref()) {
                Some(Ok(page_model)) => {
                    let page_model = page_model.clone();
                    let before = state.history.before();
                    let before = before.and_then(|b| state.kept.find(&b.chosen, &b.model)?.page_model().cloned());
                    return Ok(Judged { moment: state.history.here().clone(), page_model, before });
                }
                Some(Err(because)) => return Err(Refusal::field("effect", because.clone())),
                None => state = self.wait(state),
            }
        }
    }

    /// The present page without the views of the samples, and the last step as `add` prints it.
    ///
    /// # Errors
    /// If the model cannot be judged, or the validation rows cannot be predicted.
    pub fn document(&self) -> Result<Value, Refusal> {
        let judged = self.judged()?;
        let Judged { moment, page_model, before } = &judged;
        let gains = before.as_ref().and_then(|b| self.gains_over(moment, &b.ladder_step.model));
        let [added, _] = &moment.changed;
        let added: Vec<EffectId> = added.iter().map(EffectId::from).collect();
        let step = LadderStep { added: added.clone(), gains: gains.unwrap_or_default(), ..page_model.ladder_step.clone() };
        let below: Vec<&LadderStep> = before.iter().map(|b| &b.ladder_step).collect();
        let rung = moment.with_removed(documents::to_value(&documents::LadderStep::of(&step, &below)));
        let below = before.as_ref().filter(|_| !added.is_empty()).map(|b| &b.ladder_step);
        let objections = below.map(|below| step.objections(below));
        let taken = below.zip(objections.as_ref());
        let taken = taken.map(|(below, all)| documents::to_value(&documents::Step::of(below, &step, all, true)));
        let ladder = {
            let mut state = self.state();
            let here = state.history.here_mut();
            if here.is(moment) && here.changed == moment.changed {
                here.rung = rung;
                here.objections = objections.unwrap_or(std::mem::take(&mut here.objections));
            }
            state.ladder()
        };
        let document = self.subject(moment, |subject| page_model.json(subject, ladder))?;
        Ok(json!({"live": self.live(), "document": document, "step": taken}))
    }

    fn gains_over(&self, at: &Moment, before: &Model) -> Option<Vec<Gain>> {
        self.state().set_mut(at)?.gains_over(before).cloned()
    }

    /// The data beside the document.
    pub(super) fn live(&self) -> Value {
        live(&self.case, &self.place, &self.state())
    }

    /// The views of the samples at the moment of `judged`, once `is_enough` of its set: what is waited for is computed for the
    /// present set alone.
    pub(super) fn seen(&self, judged: &Judged, is_enough: impl Fn(&CachedFit) -> bool) -> Result<Views, Refusal> {
        let mut state = self.state();
        loop {
            let Some(set) = state.set().filter(|set| set.is(&judged.moment.chosen, &judged.moment.model)) else {
                return Err(Refusal::Changed);
            };
            match &set.views {
                Some(Err(because)) => return Err(Refusal::field("effect", because.clone())),
                Some(Ok(views)) if is_enough(set) => return Ok(views.clone()),
                _ => state = self.wait(state),
            }
        }
    }

    /// The views of the samples, with the first candidate that the data determine.
    ///
    /// # Errors
    /// When the data do not determine the model.
    pub fn views(&self) -> Result<Value, Refusal> {
        let judged = self.judged()?;
        let views = self.seen(&judged, |set| listed(set).first().is_none_or(|first| set.has_tried(first)))?;
        Ok(views.json(&judged.page_model))
    }

    /// The views with all candidates that the page lists.
    pub(super) fn views_in_full(&self) -> Result<(Judged, Views), Refusal> {
        let judged = self.judged()?;
        let views = self.seen(&judged, |set| listed(set).iter().all(|effect| set.has_tried(effect)))?;
        Ok((judged, views))
    }

    /// The share of the residuals that one candidate would explain.
    ///
    /// # Errors
    /// If the diagnosis does not name it, or the data do not determine it.
    pub fn candidate(&self, effect: &str) -> Result<Value, Refusal> {
        let judged = self.judged()?;
        if !judged.page_model.candidates().iter().any(|c| c == effect) {
            return Err(Refusal::field("effect", format!("'{effect}' is not a candidate of this diagnosis")));
        }
        {
            let mut state = self.state();
            if state.set().is_some_and(|set| set.is(&judged.moment.chosen, &judged.moment.model) && !set.has_tried(effect)) {
                state.wanted = Some(effect.to_owned());
                self.notify();
            }
        }
        let views = self.seen(&judged, |set| set.has_tried(effect))?;
        views.candidate_json(&judged.page_model, effect).ok_or_else(|| {
            let state = self.state();
            let because = state.set().and_then(|set| set.not_fitted.iter().find(|(e, _)| e == effect));
            Refusal::field("effect", because.map_or_else(String::new, |(_, because)| because.clone()))
        })
    }
}
