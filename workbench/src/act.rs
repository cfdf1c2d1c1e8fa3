//! The user's actions: each leads to another set of effects, is answered with the figures of its fit, and refused if there is
//! evidence against it.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, MutexGuard, PoisonError};

use calibench::compensate::{Compensator, Task};
use calibench::diagnosis::Examination;
use calibench::effects::registry::Registry;
use calibench::effects::{EffectId, Subject};
use calibench::files::{FileError, with_reasons};
use calibench::identify::Model;
use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::model_file::read_model;
use calibench::planning::pool::CellLayout;
use calibench::planning::propose;
use calibench::residuals::misfit::unbelievable;
use calibench::selection::ladder::{LadderProgress, observed_ladder};
use calibench::selection::recommend::Gain;
use calibench::selection::{Objection, needs_diagnosis, step_gains};
use serde_json::{Value, json};

use crate::bench::{Bench, Judged};
use crate::beside::both;
use crate::history::{History, Moment};
use crate::own_effect::{self, Draft};
use crate::refusal::Refusal;
use crate::saving::Saved;
use crate::step::Wanted;
use crate::switches::Switches;
use calibench_report::capital;
use calibench_report::{
    Page, advice, documents, each_called, ladder_step_sentence, not_added_sentence, objection_sentence, unbelievable_sentence,
};

/// Seed of the candidate postures for the next experiment: the default of `plan next`.
const NEXT_SEED: u64 = 1;

impl Bench {
    fn act(&self) -> MutexGuard<'_, ()> {
        self.acting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn here(&self) -> Moment {
        self.state().history.here().clone()
    }

    /// Switches an effect on or off. Switched on, it is added as `add` does; if that is refused, only with `force`.
    ///
    /// # Errors
    /// If there is no such effect, or the data do not determine the remaining ones.
    pub fn switch(&self, id: &str, on: bool, force: bool) -> Result<Value, Refusal> {
        let _alone = self.act();
        let here = self.here();
        let known = here.switches.find(id);
        if known.map_or(!on, |s| s.on == on) {
            return match known {
                Some(_) => Ok(self.answer(&here, &here, &[])),
                None => Err(Refusal::field("effect", format!("'{id}' is not in the model"))),
            };
        }
        let switches = if known.is_some() {
            here.switches.turned(id, on)
        } else {
            let wider = self.subject(&here, |subject| {
                let wanted = Wanted::parse(id, &here.model, subject.datasets)?;
                wanted.wider(subject.datasets, &here.model)
            });
            let (wider, added) = wider.map_err(|e| Refusal::field("effect", with_reasons(&e)))?;
            here.switches.with(&wider, &[added], id)
        };
        self.go(&here, switches, force).map_err(|e| match e {
            Refusal::Data(e) if !on => Refusal::field(
                "effect",
                format!("{} cannot be switched off: {}", here.model.registry.in_words(id), with_reasons(&e)),
            ),
            Refusal::Data(e) => Refusal::field("effect", with_reasons(&e)),
            other => other,
        })
    }

    /// Adds a user-defined effect.
    ///
    /// # Errors
    /// If it is malformed, naming the field in error, or the data do not determine it.
    pub fn own(&self, draft: &Draft, force: bool) -> Result<Value, Refusal> {
        let _alone = self.act();
        let here = self.here();
        let effect = self.subject(&here, |subject| own_effect::parse(draft, &here.model, subject.datasets[0].dataset))?;
        let name = effect.name.clone();
        let mut wider = here.model.with(&name);
        wider.own.push(effect);
        self.go(&here, here.switches.with(&wider, std::slice::from_ref(&name), &name), force)
    }

    /// Continues with the model that the ladder recommends, in one step; without a step if it is the present one.
    ///
    /// # Errors
    /// If the data do not determine the model; if it is cancelled, or another action changed the model meanwhile.
    pub fn recommend(&self) -> Result<Value, Refusal> {
        let cancelled = self.cancelled.load(Ordering::SeqCst);
        let is_cancelled = || self.cancelled.load(Ordering::SeqCst) != cancelled;
        // The ladder takes long, and keeps no other action waiting.
        let Judged { moment: here, page_model, .. } = self.judged()?;
        let mut observe = |progress: LadderProgress<'_>| {
            if is_cancelled() {
                return ControlFlow::Break(());
            }
            self.tell(&in_words(&here.model.registry, &progress));
            ControlFlow::Continue(())
        };
        let ladder = self.subject(&here, |s| observed_ladder(s.datasets, &here.model, page_model.ground(), &mut observe))?;
        let ControlFlow::Continue(ladder) = ladder else { return Err(Refusal::Cancelled) };
        let _alone = self.act();
        if is_cancelled() {
            return Err(Refusal::Cancelled);
        }
        if !self.here().is(&here) {
            return Err(Refusal::Changed);
        }
        let advice = advice(&ladder);
        let mut answer = self.go_on_to(&here, &ladder.recommended().model)?;
        answer["advice"] = json!(advice);
        Ok(answer)
    }

    /// Ends the ladder that is being run, at its next step; its result is not taken in any case.
    pub fn cancel(&self) -> Value {
        self.cancelled.fetch_add(1, Ordering::SeqCst);
        json!({})
    }

    /// Continues with the effects of a model that holds those of the present one, in one step.
    ///
    /// # Errors
    /// If the data do not determine the model.
    pub fn adopt(&self, model: &Model) -> Result<Value, Refusal> {
        let _alone = self.act();
        self.go_on_to(&self.here(), model)
    }

    /// The step to a model whose objections were considered before.
    fn go_on_to(&self, here: &Moment, model: &Model) -> Result<Value, Refusal> {
        let added: Vec<String> = model.ids().into_iter().filter(|e| !here.model.lists(e)).collect();
        match added.first() {
            None => Ok(self.answer(here, here, &[])),
            Some(first) => self.go(here, here.switches.with(model, &added, first), true),
        }
    }

    /// Reads a model file for the present data.
    ///
    /// # Errors
    /// If the file is not a model of this robot.
    pub fn read_model(&self, path: &Path) -> Result<Model, FileError> {
        let dataset = &self.case.datasets[self.here().chosen[0]].1;
        read_model(path, &Subject::new(&dataset.robot, &dataset.ball_ids()))
    }

    /// Starts over on a choice of the opened datasets, with the initial model.
    ///
    /// # Errors
    /// If one is not open, none is named, or they do not determine the model.
    pub fn choose(&self, names: &[String]) -> Result<Value, Refusal> {
        let place = |name: &String| {
            let place = self.case.datasets.iter().position(|(n, _)| n == name);
            place.ok_or_else(|| Refusal::field("datasets", format!("no dataset '{name}' is open")))
        };
        let mut chosen = names.iter().map(place).collect::<Result<Vec<usize>, _>>()?;
        chosen.sort_unstable();
        chosen.dedup();
        if chosen.is_empty() {
            return Err(Refusal::field("datasets", "choose at least one dataset"));
        }
        let _alone = self.act();
        let here = self.here();
        let next = Moment::new(chosen, here.switches.reset(), None);
        self.fit(&next)?;
        self.arrive(next.clone(), History::go_on);
        Ok(self.moved(&next))
    }

    /// Goes back by one step, or choice of data, or forward again.
    ///
    /// # Errors
    /// If there is nothing there.
    pub fn turn(&self, by: isize) -> Result<Value, Refusal> {
        let _alone = self.act();
        let nothing = || Refusal::field("undo", format!("there is nothing to {}", if by < 0 { "undo" } else { "redo" }));
        let there = self.state().history.away(by).cloned().ok_or_else(nothing)?;
        self.fit(&there)?;
        let mut state = self.state();
        state.history.turn(by);
        state.set_mut(&there);
        drop(state);
        self.notify();
        Ok(self.moved(&there))
    }

    /// Goes from the present moment to these switches, unless there is evidence against it.
    fn go(&self, here: &Moment, switches: Switches, force: bool) -> Result<Value, Refusal> {
        let mut next = Moment::new(here.chosen.clone(), switches, Some(here));
        // Both fits take a core.
        let (fitted, gains) = both(|| self.fit(&next), || self.gains(here, &next));
        fitted?;
        let Ok(gains) = gains else { return Err(Refusal::field("effect", "the step cannot be judged")) };
        next.objections = self.objections(here, &next, &gains?)?;
        if !force && next.objections.iter().any(Objection::refuses) {
            return Ok(self.answer(here, &next, &next.objections));
        }
        self.arrive(next.clone(), History::go_on);
        Ok(self.answer(here, &next, &next.objections))
    }

    /// The gains of a step, computed once.
    fn gains(&self, before: &Moment, after: &Moment) -> Result<Vec<Gain>, IdentifyError> {
        let [added, _] = &after.changed;
        if added.is_empty() {
            return Ok(Vec::new());
        }
        if let Some(known) = self.state().set_mut(after).and_then(|set| set.gains_over(&before.model).cloned()) {
            return Ok(known);
        }
        self.subject(after, |subject| step_gains(subject.datasets, &before.model, &after.model))
    }

    /// Objections to a step, judged against the set before it; none to switching off, which takes nothing for granted.
    fn objections(&self, before: &Moment, after: &Moment, gains: &[Gain]) -> Result<Vec<Objection>, Refusal> {
        let [added, _] = &after.changed;
        if added.is_empty() {
            return Ok(Vec::new());
        }
        let added: Vec<EffectId> = added.iter().map(EffectId::from).collect();
        let below = if needs_diagnosis(&added) { Some(self.judged()?.page_model) } else { None };
        let mut state = self.state();
        let Some(scores) = state.set_mut(before).map(|set| set.scores.clone()) else { return Ok(Vec::new()) };
        let Some(set) = state.set_mut(after) else { return Ok(Vec::new()) };
        if set.gains_over(&before.model).is_none() {
            set.gains.push((before.model.clone(), gains.to_vec()));
        }
        Ok(set.scores.objections(&added, gains, &scores, below.as_ref().map(|p| &p.ladder_step)))
    }

    /// The answer to an action: true if it was done, the objections to it, and the figures of the fit before and after; the
    /// page is requested next.
    fn answer(&self, before: &Moment, after: &Moment, objections: &[Objection]) -> Value {
        let (accepted, figures) = {
            let mut state = self.state();
            let accepted = state.history.here().is(after);
            let mut figures = |of: &Moment| state.set_mut(of).map(|set| set.figures.clone());
            (accepted, [figures(before), figures(after)])
        };
        let [from, to] = figures;
        let [added, removed] = &after.changed;
        let is_step = before.model != after.model;
        let words = |ids: &[String]| ids.iter().map(|id| after.switches.words(id)).collect::<Vec<_>>();
        json!({
            "accepted": accepted,
            "moved": accepted && is_step,
            "added": if is_step { words(added) } else { Vec::new() },
            "removed": if is_step { words(removed) } else { Vec::new() },
            "objections": objections.iter().map(objection_sentence).collect::<Vec<_>>(),
            "before": from,
            "after": to,
            "live": self.live(),
        })
    }

    /// The answer to an action that leads elsewhere without a step.
    fn moved(&self, to: &Moment) -> Value {
        let mut answer = self.answer(to, to, &[]);
        answer["moved"] = json!(true);
        answer
    }

    /// The next experiment, as `plan next` proposes it for these data without a scenario.
    ///
    /// # Errors
    /// When the data do not determine the model.
    pub fn next_experiment(&self) -> Result<Value, Refusal> {
        let Judged { moment: here, page_model, .. } = self.judged()?;
        let known = self.state().set_mut(&here).and_then(|set| set.proposal.clone());
        let (proposal, cell_known) = self.subject(&here, |subject| {
            let datasets = subject.datasets;
            let layout = CellLayout::of_dataset(datasets[0].dataset);
            let proposal = match known {
                Some(proposal) => proposal,
                None => {
                    let examination = Examination::new(datasets, &here.model)?;
                    Arc::new(propose(datasets, &examination, &page_model.ladder_step.diagnosis, &layout, NEXT_SEED)?)
                }
            };
            Ok::<_, Refusal>((proposal, layout.is_known))
        })?;
        let document = documents::Next { cell_known: Some(cell_known), ..documents::Next::of(&proposal) };
        if let Some(set) = self.state().set_mut(&here) {
            set.proposal = Some(proposal);
        }
        Ok(json!({"next": document}))
    }

    /// Writes the poses of the next experiment requested here: `plan.toml` and, if they are best of all, beside it the points
    /// of a tracker.
    ///
    /// # Errors
    /// If no next experiment was requested, none of its actions can be planned, or the folder cannot be written.
    pub fn save_plan(&self) -> Result<Saved, Refusal> {
        let here = self.here();
        let Some(proposal) = self.state().set_mut(&here).and_then(|set| set.proposal.clone()) else {
            return Err(Refusal::field("next", "request the next experiment first"));
        };
        let reference = &self.case.datasets[here.chosen[0]].1.robot_reference;
        match self.place.save_plan(&proposal, reference)? {
            Some(saved) => Ok(saved),
            None => Err(Refusal::field("next", "nothing on offer can be written as a plan")),
        }
    }

    /// Writes the model to `model.toml`.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_model(&self) -> Result<Saved, Refusal> {
        Ok(self.place.save_model(&self.here().model)?)
    }

    /// Writes the calibration to `calibration.toml`.
    ///
    /// # Errors
    /// If corrections are larger than any robot needs, or the folder cannot be written.
    pub fn save_calibration(&self) -> Result<Saved, Refusal> {
        let calibration = self.calibration()?;
        let saved = self.place.save_calibration(&calibration)?;
        let unconverged = calibration.unconverged();
        let warning = unconverged.map(|o| format!("; the fit {}: do not use this calibration", o.in_words()));
        Ok(saved.and(warning.as_deref().unwrap_or_default()))
    }

    /// Writes the identified links to `calibrated.urdf`: into the robot's own URDF file, if it has one.
    ///
    /// # Errors
    /// If the fit did not converge, its corrections are larger than any robot needs, or the folder cannot be written.
    pub fn save_urdf(&self) -> Result<Saved, Refusal> {
        let calibration = self.calibration()?;
        if let Some(outcome) = calibration.unconverged() {
            let remedy = "identify the robot from more postures, or with fewer effects";
            return Err(Refusal::field("effect", format!("the fit {}; {remedy}", outcome.in_words())));
        }
        let mut compensator =
            Compensator::new(&calibration, &Task::default()).map_err(|e| Refusal::field("effect", with_reasons(&e)))?;
        Ok(self.place.save_urdf(&calibration.robot, &compensator.rigid())?)
    }

    /// The present calibration, if it is credible or the data were accepted by force.
    fn calibration(&self) -> Result<Calibration, Refusal> {
        let Some(calibration) = self.state().set().map(|set| set.scores.calibration.clone()) else {
            return Err(Refusal::Changed);
        };
        match unbelievable_sentence(&unbelievable(&calibration)) {
            Some(absurd) if self.case.misfits.is_empty() => Err(Refusal::field("effect", absurd)),
            _ => Ok(calibration),
        }
    }

    /// Writes the page to `report.html`, with the steps taken and the listed candidates.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_report(&self) -> Result<Saved, Refusal> {
        // Completes the figures of the last step.
        self.document()?;
        let (judged, views) = self.views_in_full()?;
        let ladder = self.state().ladder();
        let page = self.subject(&judged.moment, |subject| Page::of(subject, &judged.page_model, ladder, &views))?;
        Ok(self.place.save_report(&page.document)?)
    }
}

/// A step of the ladder as it is run, in one line.
fn in_words(registry: &Registry, progress: &LadderProgress<'_>) -> String {
    match progress {
        LadderProgress::Trying(effects) => format!("Trying {} …", each_called(registry, effects)),
        LadderProgress::Refused(step) => capital(&not_added_sentence(registry, step, 1)),
        LadderProgress::Reached(step) => ladder_step_sentence(step),
        LadderProgress::Choosing => "Choosing between the steps and a field of joint errors …".to_owned(),
    }
}
