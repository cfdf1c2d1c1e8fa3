//! What the user has opened and done.

use calibench::assess::{
    CellLayout, Examination, Objection, Proposal, Rung, WORKSPACE_POSES, ladder, propose, step, workspace_poses,
};
use calibench::identify::{IdentifyError, Model};
use calibench::measure::Dataset;
use calibench::report::{
    Page, PageSubject, Recommended, Standing, Views, advice, next_json, objection_sentence, rung_json, step_json,
};
use serde_json::{Value, json};

use super::own_effect::{self, Draft};
use super::refusal::Refusal;
use super::saving::{Place, Saved};
use crate::blame::with_reasons;
use crate::opened::Opened;
use crate::step::Wanted;

/// Steps and choices that can be undone; each holds a fit of all samples.
const MOST_STEPS: usize = 100;

/// Seed of the postures that are tried for the next experiment: that of `next` where none is named.
const NEXT_SEED: u64 = 1;

/// One model on the chosen data.
struct Step {
    /// What speaks against it.
    objections: Vec<Objection>,
    standing: Standing,
    /// Once it was looked at.
    views: Option<Views>,
    /// What to measure next, once that was asked.
    proposal: Option<Proposal>,
}

impl Step {
    fn new(objections: Vec<Objection>, standing: Standing) -> Self {
        Step { objections, standing, views: None, proposal: None }
    }
}

/// The steps since data were chosen: the model to begin with, and one for every effect that was added.
struct Hunt {
    /// Datasets, by place.
    chosen: Vec<usize>,
    steps: Vec<Step>,
}

impl Hunt {
    fn begun(opened: &Opened, chosen: Vec<usize>) -> Result<Self, IdentifyError> {
        let standing = opened.subject(&chosen, &opened.model, &opened.commands, Standing::new)?;
        Ok(Hunt { chosen, steps: vec![Step::new(Vec::new(), standing)] })
    }
}

/// Opened data, and every step taken on them.
pub struct Bench {
    opened: Opened,
    place: Place,
    /// The last is where the user is.
    hunts: Vec<Hunt>,
}

impl Bench {
    /// Fits the model to begin with.
    ///
    /// # Errors
    /// When data and model do not go together, or do not determine the unknowns; with the data, to say whose fault it is.
    pub fn new(opened: Opened, place: Place) -> Result<Self, (Box<Opened>, IdentifyError)> {
        let all = (0..opened.datasets.len()).collect();
        match Hunt::begun(&opened, all) {
            Ok(hunt) => Ok(Bench { opened, place, hunts: vec![hunt] }),
            Err(e) => Err((Box::new(opened), e)),
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
        &self.here().standing.rung.model
    }

    /// How the commands go on that the page recommends: those of the terminal, as long as nothing was done.
    fn commands(&self) -> Recommended {
        let hunt = self.hunt();
        let mut commands = self.opened.commands.clone();
        if hunt.chosen.len() < self.opened.datasets.len() {
            commands.datasets = hunt.chosen.iter().map(|&k| self.opened.datasets[k].0.as_str()).collect::<Vec<_>>().join(" ");
        }
        if hunt.steps.len() > 1 {
            commands.model = format!(" --model {}", self.place.model().display());
        }
        commands
    }

    /// Calls `tell` with what the page is about here.
    fn subject<T>(&self, tell: impl FnOnce(&PageSubject<'_>) -> T) -> T {
        self.opened.subject(&self.hunt().chosen, self.model(), &self.commands(), tell)
    }

    /// The steps taken, as the page shows them.
    fn ladder(&self) -> Value {
        let steps = &self.hunt().steps;
        let rungs: Vec<&Rung> = steps.iter().map(|s| &s.standing.rung).collect();
        let rungs: Vec<Value> = (0..rungs.len()).map(|k| rung_json(rungs[k], &rungs[..k])).collect();
        let objections: Vec<String> = self.here().objections.iter().map(objection_sentence).collect();
        let step =
            (steps.len() > 1).then(|| json!({"effect": self.here().standing.rung.added.join(" + "), "objections": objections}));
        json!({"rungs": rungs, "complete": true, "step": step})
    }

    /// What stands beside the document: the data that can be chosen, the model, and what can be done.
    fn live(&self) -> Value {
        let hunt = self.hunt();
        let datasets = self
            .opened
            .datasets
            .iter()
            .enumerate()
            .map(|(k, (name, d))| json!({"name": name, "samples": d.samples.len(), "chosen": hunt.chosen.contains(&k)}));
        let joints = self.here().standing.rung.calibration.robot.joints();
        let each = |from: usize, site: &'static str| (from..from + joints).map(move |j| format!("{site}:{j}"));
        let sites: Vec<String> = each(1, "theta").chain(each(1, "d")).chain(each(0, "alpha")).chain(each(0, "a")).collect();
        json!({
            "datasets": datasets.collect::<Vec<_>>(),
            "effects": self.model().effects,
            "candidates": self.here().standing.candidates(),
            "sites": sites,
            "can_undo": hunt.steps.len() > 1 || self.hunts.len() > 1,
            "saves_to": self.place.folder().display().to_string(),
        })
    }

    /// The page as it stands, without the views of the samples.
    ///
    /// # Errors
    /// When the rows to judge on cannot be predicted.
    pub fn document(&self) -> Result<Value, Refusal> {
        let document = self.subject(|subject| self.here().standing.json(subject, self.ladder()))?;
        Ok(json!({"live": self.live(), "document": document}))
    }

    /// Looks at every sample, and at a candidate of the diagnosis, or the first of them; its place among those that were looked at.
    fn look(&mut self, effect: Option<&str>) -> Result<Option<usize>, Refusal> {
        let looked = self.subject(|subject| {
            let here = self.here();
            let fresh = if here.views.is_none() { Some(Views::new(subject, &here.standing)?) } else { None };
            Ok::<_, IdentifyError>(fresh)
        })?;
        if looked.is_some() {
            self.here_mut().views = looked;
        }
        let Some(mut views) = self.here_mut().views.take() else { return Ok(None) };
        let place = self.subject(|subject| views.look_at(subject, &self.here().standing, effect));
        self.here_mut().views = Some(views);
        Ok(place?)
    }

    /// The views of the samples, with the first candidate.
    ///
    /// # Errors
    /// When the data do not determine the model.
    pub fn views(&mut self) -> Result<Value, Refusal> {
        // A candidate that the data do not determine is not shown.
        match self.look(None) {
            Ok(_) | Err(Refusal::Data(_)) => {}
            Err(other) => return Err(other),
        }
        let here = self.here();
        Ok(here.views.as_ref().map_or(Value::Null, |v| v.json(&here.standing)))
    }

    /// What one candidate would take of the residuals.
    ///
    /// # Errors
    /// When the diagnosis does not name it, or the data do not determine it.
    pub fn candidate(&mut self, effect: &str) -> Result<Value, Refusal> {
        let place = self.look(Some(effect))?;
        let place = place.ok_or_else(|| Refusal::field("effect", format!("'{effect}' is no candidate of this diagnosis")))?;
        let here = self.here();
        Ok(here.views.as_ref().map_or(Value::Null, |v| v.candidate_json(&here.standing, place)))
    }

    /// Begins anew on other datasets of those that are open.
    ///
    /// # Errors
    /// When one is not open, or none is named, or they do not determine the model.
    pub fn choose(&mut self, names: &[String]) -> Result<Value, Refusal> {
        let place = |name: &String| {
            let place = self.opened.datasets.iter().position(|(n, _)| n == name);
            place.ok_or_else(|| Refusal::field("datasets", format!("no dataset '{name}' is open")))
        };
        let mut chosen = names.iter().map(place).collect::<Result<Vec<usize>, _>>()?;
        chosen.sort_unstable();
        chosen.dedup();
        if chosen.is_empty() {
            return Err(Refusal::field("datasets", "choose at least one dataset"));
        }
        self.room()?;
        let hunt = Hunt::begun(&self.opened, chosen)?;
        self.hunts.push(hunt);
        self.document()
    }

    /// Adds an effect, as `add` does; a step against which something speaks is taken only by `force`.
    ///
    /// # Errors
    /// When there is no such effect, or the data do not determine it.
    pub fn add(&mut self, effect: &str, force: bool) -> Result<Value, Refusal> {
        self.room()?;
        let after = self.with_data(|datasets, here| {
            let wanted = Wanted::parse(effect, &here.rung.model, datasets)?;
            wanted.take(datasets, &here.rung, here.ground())
        });
        let after = after.map_err(|e| Refusal::field("effect", with_reasons(&e)))?;
        self.taken(after, force)
    }

    /// Adds an effect of the user's own.
    ///
    /// # Errors
    /// When it is not well formed, with the field that is to blame, or the data do not determine it.
    pub fn own(&mut self, draft: &Draft, force: bool) -> Result<Value, Refusal> {
        self.room()?;
        let after = self.with_data(|datasets, here| {
            let first = datasets[0].1;
            let effect = own_effect::parse(draft, &here.rung.model, first)?;
            let mut model = here.rung.model.with(&effect.name);
            let name = effect.name.clone();
            model.own.push(effect);
            Ok::<_, Refusal>(step(datasets, &here.rung, &model, vec![name], here.ground())?)
        })?;
        self.taken(after, force)
    }

    /// Takes the model that the ladder recommends from here on, in one step; none where it is the present one.
    ///
    /// # Errors
    /// When the data do not determine the model.
    pub fn recommend(&mut self) -> Result<Value, Refusal> {
        self.room()?;
        let climbed = self.with_data(|datasets, here| ladder(datasets, &here.rung.model, here.ground(), &mut |_| ()))?;
        let advice = advice(&climbed);
        let recommended = climbed.recommended();
        let present = &self.model().effects;
        let added: Vec<String> = recommended.model.effects.iter().filter(|e| !present.contains(e)).cloned().collect();
        if added.is_empty() {
            return Ok(json!({"advice": advice}));
        }
        // What speaks against it was weighed by the ladder.
        let mut answer = self.accept(Rung { added, ..recommended.clone() }, Vec::new())?;
        answer["advice"] = json!(advice);
        Ok(answer)
    }

    fn with_data<T>(&self, act: impl FnOnce(&[(&str, &Dataset)], &Standing) -> T) -> T {
        self.subject(|subject| act(subject.datasets, &self.here().standing))
    }

    /// Goes on from a step, unless it is refused.
    fn taken(&mut self, after: Rung, force: bool) -> Result<Value, Refusal> {
        let before = &self.here().standing;
        let objections = after.objections(&before.rung);
        let accepted = force || !objections.iter().any(Objection::refuses);
        if !accepted {
            return Ok(json!({"step": step_json(&before.rung, &after, &objections, accepted)}));
        }
        self.accept(after, objections)
    }

    fn accept(&mut self, after: Rung, objections: Vec<Objection>) -> Result<Value, Refusal> {
        let before = &self.here().standing;
        let step = step_json(&before.rung, &after, &objections, true);
        let standing = self.subject(|subject| before.stepped(after, subject))?;
        let last = self.hunts.len() - 1;
        self.hunts[last].steps.push(Step::new(objections, standing));
        let mut answer = self.document()?;
        answer["step"] = step;
        Ok(answer)
    }

    fn room(&self) -> Result<(), Refusal> {
        let steps: usize = self.hunts.iter().map(|h| h.steps.len()).sum();
        if steps < MOST_STEPS {
            return Ok(());
        }
        Err(Refusal::field("effect", format!("{MOST_STEPS} steps are kept at most; save the model, and open it anew")))
    }

    /// Takes back the last step, or the last choice of data.
    ///
    /// # Errors
    /// When nothing was done.
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
            let examination = Examination::new(datasets, &here.rung.model)?;
            let first = datasets[0].1;
            let poses = workspace_poses(first, WORKSPACE_POSES);
            let diagnosis = &here.rung.diagnosis;
            let layout = CellLayout::of_dataset(first);
            let proposal = propose(datasets, &examination, diagnosis, &diagnosis.relevance, &layout, &poses, NEXT_SEED)?;
            Ok::<_, Refusal>((proposal, layout.is_known))
        })?;
        let mut document = next_json(&proposal);
        document["cell_known"] = json!(cell_known);
        self.here_mut().proposal = Some(proposal);
        Ok(json!({"next": document}))
    }

    /// Writes the poses of the next experiment that was asked for here: `plan.toml`, and beside it the points of a tracker where they
    /// are best of all.
    ///
    /// # Errors
    /// When the next experiment was not asked for, nothing on offer can be planned, or the folder cannot be written.
    pub fn save_plan(&mut self) -> Result<Saved, Refusal> {
        let Some(proposal) = &self.here().proposal else {
            return Err(Refusal::field("next", "ask for the next experiment first"));
        };
        let reference = &self.opened.datasets[self.hunt().chosen[0]].1.robot_reference;
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

    /// Writes the page to `report.html`, with the steps taken and the candidates that were looked at.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_report(&mut self) -> Result<Saved, Refusal> {
        self.views()?;
        let here = self.here();
        let Some(views) = &here.views else { return Err(Refusal::field("report", "there is nothing to show yet")) };
        let page = self.subject(|subject| Page::of(subject, &here.standing, self.ladder(), views))?;
        Ok(self.place.save_report(&page.document)?)
    }
}
