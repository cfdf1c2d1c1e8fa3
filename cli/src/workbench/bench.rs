//! State of the workbench: the opened data and the user's actions.

use calibench::assess::{CellLayout, Examination, LadderStep, Objection, Proposal, ladder, propose, step};
use calibench::identify::{IdentifyError, Model};
use calibench::measure::Dataset;
use calibench_report::{Page, PageModel, PageSubject, Recommended, Views, advice, documents, objection_sentence};
use serde_json::{Value, json};

use super::own_effect::{self, Draft};
use super::refusal::Refusal;
use super::saving::{Place, Saved};
use crate::case::Case;
use crate::step::Wanted;
use calibench::files::with_reasons;

/// Number of steps and choices that can be undone; each holds a fit of all samples.
const MOST_STEPS: usize = 100;

/// Seed of the candidate postures for the next experiment: the default of `next`.
const NEXT_SEED: u64 = 1;

/// One model on the chosen data.
struct Step {
    /// Objections to it.
    objections: Vec<Objection>,
    page_model: PageModel,
    /// Present once computed.
    views: Option<Views>,
    /// The next measurements, once requested.
    proposal: Option<Proposal>,
}

impl Step {
    fn new(objections: Vec<Objection>, page_model: PageModel) -> Self {
        Step { objections, page_model, views: None, proposal: None }
    }
}

/// The steps since data were chosen: the initial model, and one per added effect.
struct Hunt {
    /// Datasets, by index.
    chosen: Vec<usize>,
    steps: Vec<Step>,
}

impl Hunt {
    fn begun(case: &Case, chosen: Vec<usize>) -> Result<Self, IdentifyError> {
        let page_model = case.subject(&chosen, &case.model, &case.commands, PageModel::new)?;
        Ok(Hunt { chosen, steps: vec![Step::new(Vec::new(), page_model)] })
    }
}

/// The opened data, and every step taken on them.
pub struct Bench {
    case: Case,
    place: Place,
    /// The last is the current one.
    hunts: Vec<Hunt>,
}

impl Bench {
    /// Fits the initial model.
    ///
    /// # Errors
    /// If data and model do not match, or the data do not determine the unknowns; the data are returned so that the error can
    /// be located.
    pub fn new(case: Case, place: Place) -> Result<Self, (Box<Case>, IdentifyError)> {
        let all = (0..case.datasets.len()).collect();
        match Hunt::begun(&case, all) {
            Ok(hunt) => Ok(Bench { case, place, hunts: vec![hunt] }),
            Err(e) => Err((Box::new(case), e)),
        }
    }

    fn hunt(&self) -> &Hunt {
        &self.hunts[self.hunts.len() - 1]
    }

    fn here(&self) -> &Step {
        let steps = &self.hunt().steps;
        &steps[steps.len() - 1]
    }

    fn here_mut(&mut self) -> &mut Step {
        let hunt = self.hunts.len() - 1;
        let step = self.hunts[hunt].steps.len() - 1;
        &mut self.hunts[hunt].steps[step]
    }

    fn model(&self) -> &Model {
        &self.here().page_model.ladder_step.model
    }

    /// The arguments of the commands recommended by the page: those of the terminal as long as nothing was done.
    fn commands(&self) -> Recommended {
        let hunt = self.hunt();
        let mut commands = self.case.commands.clone();
        if hunt.chosen.len() < self.case.datasets.len() {
            commands.datasets = hunt.chosen.iter().map(|&k| self.case.datasets[k].0.as_str()).collect::<Vec<_>>().join(" ");
        }
        if hunt.steps.len() > 1 {
            commands.model = format!(" --model {}", self.place.model().display());
        }
        commands
    }

    /// Calls `tell` with the present subject of the page.
    fn subject<T>(&self, tell: impl FnOnce(&PageSubject<'_>) -> T) -> T {
        self.case.subject(&self.hunt().chosen, self.model(), &self.commands(), tell)
    }

    /// The steps taken, as the page shows them.
    fn ladder(&self) -> Value {
        let steps = &self.hunt().steps;
        let steps: Vec<&LadderStep> = steps.iter().map(|s| &s.page_model.ladder_step).collect();
        let steps = documents::LadderStep::all(&steps);
        let objections: Vec<String> = self.here().objections.iter().map(objection_sentence).collect();
        let step = (steps.len() > 1)
            .then(|| json!({"effect": self.here().page_model.ladder_step.added.join(" + "), "objections": objections}));
        json!({"rungs": steps, "complete": true, "step": step})
    }

    /// The data beside the document: datasets that can be chosen, the model, and available actions.
    fn live(&self) -> Value {
        let hunt = self.hunt();
        let datasets = self
            .case
            .datasets
            .iter()
            .enumerate()
            .map(|(k, (name, d))| json!({"name": name, "samples": d.samples.len(), "chosen": hunt.chosen.contains(&k)}));
        let joints = self.here().page_model.ladder_step.calibration.robot.joints();
        let each = |from: usize, site: &'static str| (from..from + joints).map(move |j| format!("{site}:{j}"));
        let sites: Vec<String> = each(1, "theta").chain(each(1, "d")).chain(each(0, "alpha")).chain(each(0, "a")).collect();
        json!({
            "datasets": datasets.collect::<Vec<_>>(),
            "effects": self.model().effects,
            "candidates": self.here().page_model.candidates(),
            "sites": sites,
            "can_undo": hunt.steps.len() > 1 || self.hunts.len() > 1,
            "saves_to": self.place.folder().display().to_string(),
        })
    }

    /// The current page without the views of the samples.
    ///
    /// # Errors
    /// If the validation rows cannot be predicted.
    pub fn document(&self) -> Result<Value, Refusal> {
        let document = self.subject(|subject| self.here().page_model.json(subject, self.ladder()))?;
        Ok(json!({"live": self.live(), "document": document}))
    }

    /// Computes the views and fits a candidate of the diagnosis, the first if `effect` is `None`; returns its index among those
    /// fitted.
    fn look(&mut self, effect: Option<&str>) -> Result<Option<usize>, Refusal> {
        let looked = self.subject(|subject| {
            let here = self.here();
            let fresh = if here.views.is_none() { Some(Views::new(subject, &here.page_model)?) } else { None };
            Ok::<_, IdentifyError>(fresh)
        })?;
        if looked.is_some() {
            self.here_mut().views = looked;
        }
        let Some(mut views) = self.here_mut().views.take() else { return Ok(None) };
        let place = self.subject(|subject| views.look_at(subject, &self.here().page_model, effect));
        self.here_mut().views = Some(views);
        Ok(place?)
    }

    /// The views of the samples, with the first candidate.
    ///
    /// # Errors
    /// When the data do not determine the model.
    pub fn views(&mut self) -> Result<Value, Refusal> {
        // A candidate that the data do not determine is omitted.
        match self.look(None) {
            Ok(_) | Err(Refusal::Data(_)) => {}
            Err(other) => return Err(other),
        }
        let here = self.here();
        Ok(here.views.as_ref().map_or(Value::Null, |v| v.json(&here.page_model)))
    }

    /// The share of the residuals that one candidate would explain.
    ///
    /// # Errors
    /// If the diagnosis does not name it, or the data do not determine it.
    pub fn candidate(&mut self, effect: &str) -> Result<Value, Refusal> {
        let place = self.look(Some(effect))?;
        let place = place.ok_or_else(|| Refusal::field("effect", format!("'{effect}' is no candidate of this diagnosis")))?;
        let here = self.here();
        Ok(here.views.as_ref().map_or(Value::Null, |v| v.candidate_json(&here.page_model, place)))
    }

    /// Starts over on a choice of the opened datasets.
    ///
    /// # Errors
    /// If one is not open, none is named, or they do not determine the model.
    pub fn choose(&mut self, names: &[String]) -> Result<Value, Refusal> {
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
        self.room()?;
        let hunt = Hunt::begun(&self.case, chosen)?;
        self.hunts.push(hunt);
        self.document()
    }

    /// Adds an effect, as `add` does; a step that is refused is taken only with `force`.
    ///
    /// # Errors
    /// If there is no such effect, or the data do not determine it.
    pub fn add(&mut self, effect: &str, force: bool) -> Result<Value, Refusal> {
        self.room()?;
        let after = self.with_data(|datasets, here| {
            let wanted = Wanted::parse(effect, &here.ladder_step.model, datasets)?;
            wanted.take(datasets, &here.ladder_step, here.ground())
        });
        let after = after.map_err(|e| Refusal::field("effect", with_reasons(&e)))?;
        self.taken(after, force)
    }

    /// Adds a user-defined effect.
    ///
    /// # Errors
    /// If it is malformed, naming the field in error, or the data do not determine it.
    pub fn own(&mut self, draft: &Draft, force: bool) -> Result<Value, Refusal> {
        self.room()?;
        let after = self.with_data(|datasets, here| {
            let first = datasets[0].1;
            let effect = own_effect::parse(draft, &here.ladder_step.model, first)?;
            let mut model = here.ladder_step.model.with(&effect.name);
            let name = effect.name.clone();
            model.own.push(effect);
            Ok::<_, Refusal>(step(datasets, &here.ladder_step, &model, vec![name], here.ground())?)
        })?;
        self.taken(after, force)
    }

    /// Continues with the model that the ladder recommends, in one step; without a step if it is the present one.
    ///
    /// # Errors
    /// If the data do not determine the model.
    pub fn recommend(&mut self) -> Result<Value, Refusal> {
        self.room()?;
        let climbed = self.with_data(|datasets, here| ladder(datasets, &here.ladder_step.model, here.ground(), &mut |_| ()))?;
        let advice = advice(&climbed);
        let recommended = climbed.recommended();
        let present = &self.model().effects;
        let added: Vec<String> = recommended.model.effects.iter().filter(|e| !present.contains(e)).cloned().collect();
        if added.is_empty() {
            return Ok(json!({"advice": advice}));
        }
        // The ladder has already considered the objections.
        let mut answer = self.accept(LadderStep { added, ..recommended.clone() }, Vec::new())?;
        answer["advice"] = json!(advice);
        Ok(answer)
    }

    fn with_data<T>(&self, act: impl FnOnce(&[(&str, &Dataset)], &PageModel) -> T) -> T {
        self.subject(|subject| act(subject.datasets, &self.here().page_model))
    }

    /// Continues from a step, unless it is refused.
    fn taken(&mut self, after: LadderStep, force: bool) -> Result<Value, Refusal> {
        let before = &self.here().page_model;
        let objections = after.objections(&before.ladder_step);
        let accepted = force || !objections.iter().any(Objection::refuses);
        if !accepted {
            return Ok(json!({"step": documents::Step::of(&before.ladder_step, &after, &objections, accepted)}));
        }
        self.accept(after, objections)
    }

    fn accept(&mut self, after: LadderStep, objections: Vec<Objection>) -> Result<Value, Refusal> {
        let before = &self.here().page_model;
        let step = documents::Step::of(&before.ladder_step, &after, &objections, true);
        let page_model = self.subject(|subject| before.stepped(after, subject))?;
        let last = self.hunts.len() - 1;
        self.hunts[last].steps.push(Step::new(objections, page_model));
        let mut answer = self.document()?;
        answer["step"] = documents::to_value(&step);
        Ok(answer)
    }

    fn room(&self) -> Result<(), Refusal> {
        let steps: usize = self.hunts.iter().map(|h| h.steps.len()).sum();
        if steps < MOST_STEPS {
            return Ok(());
        }
        Err(Refusal::field("effect", format!("{MOST_STEPS} steps are kept at most; save the model, and open it anew")))
    }

    /// Undoes the last step, or the last choice of data.
    ///
    /// # Errors
    /// If there is nothing to undo.
    pub fn undo(&mut self) -> Result<Value, Refusal> {
        let last = self.hunts.len() - 1;
        if self.hunts[last].steps.len() > 1 {
            self.hunts[last].steps.pop();
        } else if last > 0 {
            self.hunts.pop();
        } else {
            return Err(Refusal::field("undo", "there is nothing to undo"));
        }
        self.document()
    }

    /// The next experiment, as `next` proposes it for these data without a scenario.
    ///
    /// # Errors
    /// When the data do not determine the model.
    pub fn next_experiment(&mut self) -> Result<Value, Refusal> {
        let (proposal, cell_known) = self.with_data(|datasets, here| {
            let examination = Examination::new(datasets, &here.ladder_step.model)?;
            let first = datasets[0].1;
            let layout = CellLayout::of_dataset(first);
            let proposal = propose(datasets, &examination, &here.ladder_step.diagnosis, &layout, NEXT_SEED)?;
            Ok::<_, Refusal>((proposal, layout.is_known))
        })?;
        let document = documents::Next { cell_known: Some(cell_known), ..documents::Next::of(&proposal) };
        self.here_mut().proposal = Some(proposal);
        Ok(json!({"next": document}))
    }

    /// Writes the poses of the next experiment requested here: `plan.toml` and, if they are best of all, beside it the points
    /// of a tracker.
    ///
    /// # Errors
    /// If no next experiment was requested, none of its actions can be planned, or the folder cannot be written.
    pub fn save_plan(&mut self) -> Result<Saved, Refusal> {
        let Some(proposal) = &self.here().proposal else {
            return Err(Refusal::field("next", "ask for the next experiment first"));
        };
        let reference = &self.case.datasets[self.hunt().chosen[0]].1.robot_reference;
        match self.place.save_plan(proposal, reference)? {
            Some(saved) => Ok(saved),
            None => Err(Refusal::field("next", "nothing on offer can be written as a plan")),
        }
    }

    /// Writes the model to `model.toml`.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_model(&self) -> Result<Saved, Refusal> {
        Ok(self.place.save_model(self.model())?)
    }

    /// Writes the page to `report.html`, with the steps taken and the candidates examined.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_report(&mut self) -> Result<Saved, Refusal> {
        self.views()?;
        let here = self.here();
        let Some(views) = &here.views else { return Err(Refusal::field("report", "there is nothing to show yet")) };
        let page = self.subject(|subject| Page::of(subject, &here.page_model, self.ladder(), views))?;
        Ok(self.place.save_report(&page.document)?)
    }
}
