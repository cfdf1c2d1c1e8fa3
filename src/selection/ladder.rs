//! The ladder: effects are added to a model one at a time, the same data are fitted again, and one of the models is
//! recommended in the end.

mod field;
pub(crate) mod next_step;
mod progress;
pub(crate) mod step;

use std::ops::ControlFlow;

use next_step::next_step;
use progress::{Interrupted, Observer, report, unobserved};

pub use next_step::{Next, best_step};
pub use progress::LadderProgress;
pub use step::{LadderStep, add, ladder_step, step};

use super::hold_out::HoldOut;
use crate::diagnosis::Examination;
use crate::diagnosis::Verdict;

use self::step::readily_fitted;
use super::objections::Objection;
use super::recommend::{Choice, ChoiceKind as Kind, Gain, Recommendation, SizedCandidate, recommend};
use super::withdrawal::{Contradiction, contradicted};
use crate::diagnosis::library::Library;
use crate::effects::{self, EffectId};
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::Outcome;
use crate::identify::problem::{Use, missing, takes_orientations};
use crate::identify::{Model, identify};
use crate::measure::dataset::{NamedDataset, Sample};

/// Largest number of steps that are added to the first model.
const MOST_STEPS: usize = 16;

/// Models whose squared errors at left-out postures are within this factor of the best count as equally good; the
/// choice among them then depends on how well they extrapolate.
const ABOUT_AS_GOOD: f64 = 1.5;

/// Largest number of iterations of a fit that is trusted. A slower fit creeps along a valley that its data do not
/// determine, so its predictions at other poses are not supported by them, even if it predicts rows near the fitted
/// ones well. Useful models of real robots took 6 to 69 iterations, a harmful one 220.
pub const READILY: usize = 120;

/// Reason why a ladder ends.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum StopReason {
    /// The residual is noise.
    NothingLeft,
    /// The residual is noise, and larger than stated.
    NoiseLargerThanStated,
    /// The fit of the last model did not converge, so its residual means nothing.
    NotConverged(Outcome),
    /// None of the steps tried improves the prediction at left-out postures.
    NoStepHelps {
        /// The steps tried.
        tried: Vec<RefusedStep>,
    },
    /// The largest number of steps was reached.
    StepLimit,
}

/// A step that was tried and refused.
#[derive(Debug, Clone, PartialEq)]
pub struct RefusedStep {
    /// The effects that it would add, as ids: one, or all samples that disagree with the others.
    pub effects: Vec<EffectId>,
    /// The objections to it.
    pub objections: Vec<Objection>,
}

impl StopReason {
    /// Name in files.
    pub fn name(&self) -> &'static str {
        match self {
            StopReason::NothingLeft => "nothing_left",
            StopReason::NoiseLargerThanStated => "noise_larger_than_stated",
            StopReason::NotConverged(_) => "not_converged",
            StopReason::NoStepHelps { .. } => "no_step_helps",
            StopReason::StepLimit => "most_rungs",
        }
    }
}

/// The steps from a first model towards the noise, and the recommended model.
#[derive(Debug, Clone)]
pub struct Ladder {
    /// The steps, starting with the first model.
    pub steps: Vec<LadderStep>,
    /// Reason why it ends.
    pub top: StopReason,
    /// Every model that was compared with the first.
    pub recommendation: Recommendation,
    /// The recommended model, fitted, if it is not one of the steps.
    pub other: Option<LadderStep>,
    /// Contradiction by the rows of set `validation`, which the choice did not use: the recommendation is withdrawn.
    pub withdrawn: Option<Contradiction>,
}

impl Ladder {
    /// The first model.
    pub fn first(&self) -> &LadderStep {
        &self.steps[0]
    }

    /// The last step.
    pub fn last(&self) -> &LadderStep {
        &self.steps[self.steps.len() - 1]
    }

    /// Kind of the recommended model.
    pub fn kind(&self) -> Kind {
        if self.withdrawn.is_some() { Kind::Begin } else { self.recommendation.choice().kind }
    }

    /// The recommended model.
    pub fn recommended(&self) -> &LadderStep {
        match (&self.withdrawn, &self.other) {
            (Some(_), _) => self.first(),
            (None, Some(other)) => other,
            (None, None) => step_of(&self.steps, self.recommendation.choice()).unwrap_or(self.first()),
        }
    }
}

/// Diagnoses, adds effects and refits until nothing is left or nothing helps; then compares the steps with the error
/// curves of all joints and the whole library.
///
/// # Errors
/// As [`ladder_step`], for the first model. A step that cannot be fitted is not taken.
pub fn ladder(datasets: &[NamedDataset<'_>], model: &Model, ground: HoldOut<'_>) -> Result<Ladder, IdentifyError> {
    Ok(run(datasets, model, ground, &mut unobserved)?)
}

/// As [`ladder`], and reports its progress to `observer`, which cancels it with `Break`: the result is then that `Break`.
///
/// # Errors
/// As [`ladder`].
pub fn observed_ladder<B>(
    datasets: &[NamedDataset<'_>],
    model: &Model,
    ground: HoldOut<'_>,
    observer: &mut dyn FnMut(LadderProgress<'_>) -> ControlFlow<B>,
) -> Result<ControlFlow<B, Ladder>, IdentifyError> {
    match run(datasets, model, ground, observer) {
        Ok(ladder) => Ok(ControlFlow::Continue(ladder)),
        Err(Interrupted::Cancelled(value)) => Ok(ControlFlow::Break(value)),
        Err(Interrupted::Failed(error)) => Err(error),
    }
}

fn run<B>(
    datasets: &[NamedDataset<'_>],
    model: &Model,
    ground: HoldOut<'_>,
    observer: &mut Observer<'_, B>,
) -> Result<Ladder, Interrupted<B>> {
    let mut steps = vec![ladder_step(datasets, model, ground)?];
    report(observer, LadderProgress::Reached(&steps[0]))?;
    let top = loop {
        let below = &steps[steps.len() - 1];
        if below.diagnosis.verdict.is_noise() {
            break match below.calibration.unconverged() {
                Some(outcome) => StopReason::NotConverged(outcome),
                None if below.diagnosis.verdict == Verdict::NoiseLargerThanStated => StopReason::NoiseLargerThanStated,
                None => StopReason::NothingLeft,
            };
        }
        if steps.len() > MOST_STEPS {
            break StopReason::StepLimit;
        }
        match next_step(datasets, &steps, ground, observer)? {
            Ok(next) => {
                report(observer, LadderProgress::Reached(&next))?;
                steps.push(*next);
            }
            Err(tried) => break StopReason::NoStepHelps { tried },
        }
    };
    end(datasets, steps, top, ground, observer)
}

/// The ladder that ends at `step`, after which none of the steps tried helps: what is left of it is the choice among models of all
/// errors at once.
///
/// # Errors
/// As [`ladder`].
pub(super) fn ending_at(
    datasets: &[NamedDataset<'_>],
    step: &LadderStep,
    tried: Vec<RefusedStep>,
    ground: HoldOut<'_>,
) -> Result<Ladder, IdentifyError> {
    Ok(end(datasets, vec![step.clone()], StopReason::NoStepHelps { tried }, ground, &mut unobserved)?)
}

/// Compares the steps with models of all errors at once, and recommends one of them.
fn end<B>(
    datasets: &[NamedDataset<'_>],
    steps: Vec<LadderStep>,
    top: StopReason,
    ground: HoldOut<'_>,
    observer: &mut Observer<'_, B>,
) -> Result<Ladder, Interrupted<B>> {
    report(observer, LadderProgress::Choosing)?;
    let first = &steps[0];
    let model = first.model.clone();
    let added: Vec<EffectId> = steps[1..].iter().flat_map(|r| r.added.iter().cloned()).collect();
    let last = &steps[steps.len() - 1].model;
    let with_shapes = Model { own: last.own.clone(), width: last.width.clone(), ..model.clone() };
    let examination = Examination::with(datasets, &with_shapes, Vec::new())?;
    let sets_suspects_aside =
        |r: &&LadderStep| r.added == first.diagnosis.without_suspects() && r.objection_of_the_others(first).is_none();
    let bad = steps.get(1).filter(sets_suspects_aside).map_or(&[][..], |ladder_step| &ladder_step.added);
    let mut recommendation = recommend(datasets, &examination, [&added, bad], &library(datasets, first, ground))?;
    for choice in &mut recommendation.choices {
        // Of the shapes a model keeps those that it contains.
        let Model { effects, own, width, .. } = &mut choice.model;
        let is_known = |name: &str| effects.iter().any(|e| *e == name) || model.own.iter().any(|o| o.name == name);
        own.retain(|o| is_known(&o.name));
        width.retain(|name, _| is_known(name) || model.width.contains_key(name));
    }
    let (chosen, mut other) = choose(datasets, &steps, &recommendation, ground)?;
    recommendation.chosen = chosen;
    let named = other.as_ref().or_else(|| step_of(&steps, recommendation.choice())).unwrap_or(first);
    if let Some((choice, step)) = field::beyond(datasets, &model, named, ground)? {
        recommendation.choices.push(choice);
        if step.is_some() {
            recommendation.chosen = recommendation.choices.len() - 1;
            other = step;
        }
    }
    if let Some(ladder_step) = &other {
        report(observer, LadderProgress::Reached(ladder_step))?;
    }
    let first = &steps[0];
    let taken = other.as_ref().or_else(|| step_of(&steps, recommendation.choice())).unwrap_or(first);
    let withdrawn = contradicted(datasets, &first.calibration, &taken.calibration)?;
    let mut ladder = Ladder { steps, top, recommendation, other, withdrawn };
    let chosen = &ladder.recommendation.choice().model.effects;
    let (first, above) = ladder.steps.split_at_mut(1);
    let recommended = above.iter_mut().find(|step| step.model.effects == *chosen);
    first.iter_mut().chain(recommended).chain(&mut ladder.other).for_each(|step| fit_orientations(datasets, step));
    Ok(ladder)
}

/// Fits orientations too where the step was judged without them: which model is right the positions say, but who is to use it needs
/// an arm that also points where it should.
fn fit_orientations(datasets: &[NamedDataset<'_>], step: &mut LadderStep) {
    let is_one = |s: &Sample| Use::Fit.takes(s) && s.orientation.is_some();
    let leaves_out =
        |d: &NamedDataset<'_>| !takes_orientations(d.dataset, &step.calibration.model) && d.dataset.samples.iter().any(is_one);
    if !datasets.iter().any(leaves_out) {
        return;
    }
    let whole = Model { only_weighed_orientations: false, ..step.calibration.model.clone() };
    if let Ok(calibration) = identify(datasets, &whole)
        && calibration.unconverged().is_none()
    {
        step.calibration = calibration;
    }
}

/// The step that has the same model as a choice, if there is one.
fn step_of<'r>(steps: &'r [LadderStep], choice: &Choice) -> Option<&'r LadderStep> {
    steps.iter().find(|ladder_step| ladder_step.model.effects == choice.model.effects)
}

/// Fits the choices that are about equally good at left-out postures. Selects the one with the lowest geometric mean of
/// the error there and the error expected over the workspace. Returns its index, and its step if it is not one of the
/// ladder's.
///
/// Choices that do not converge readily, or that a left-out campaign contradicts, are excluded. Nothing is added to steps whose
/// residual is noise unless left-out postures are then predicted better beyond chance.
fn choose(
    datasets: &[NamedDataset<'_>],
    steps: &[LadderStep],
    recommendation: &Recommendation,
    ground: HoldOut<'_>,
) -> Result<(usize, Option<LadderStep>), IdentifyError> {
    let first = &steps[0];
    let begun_well = first.calibration.unconverged().is_none();
    let ranked = recommendation.ranked();
    let left = |place: usize| recommendation.choices[place].left();
    let ends_at_noise = steps.last().is_some_and(|last| {
        let converged = last.calibration.unconverged().is_none() && last.calibration.iterations <= READILY;
        converged && last.diagnosis.verdict.is_noise() && last.measured_worse_than(first).is_none()
    });
    let at_noise = recommendation.of_kind(Kind::Steps).filter(|choice| ends_at_noise && choice.convinces());
    let (mut lowest_left, mut best) = (None, None::<(usize, Option<LadderStep>, f64)>);
    for &place in &ranked {
        let choice = &recommendation.choices[place];
        if choice.kind == Kind::Begin || lowest_left.is_some_and(|lowest| left(place) > ABOUT_AS_GOOD * lowest) {
            break;
        }
        if at_noise.is_some_and(|at_noise| choice.kind != Kind::Steps && !is_surely_better(choice, at_noise)) {
            continue;
        }
        let known = step_of(steps, choice).filter(|_| choice.kind == Kind::Steps);
        let reached = match known {
            Some(_) => None,
            None => match readily_fitted(datasets, &choice.model, ground) {
                Ok(ladder_step) => Some(LadderStep { added: choice.added.clone(), gains: choice.gains.clone(), ..ladder_step }),
                Err(_) => continue,
            },
        };
        let Some(taken) = reached.as_ref().or(known) else { continue };
        // If the first fit did not converge, a choice must also improve the error when it is refitted without each
        // block in turn.
        if taken.calibration.unconverged().is_some()
            || taken.calibration.iterations > READILY
            || (!begun_well && taken.cross_validated >= first.cross_validated)
            || taken.objections(first).iter().any(Objection::is_measured_elsewhere)
        {
            continue;
        }
        lowest_left.get_or_insert(left(place));
        let expected = taken.workspace.as_ref().map_or(taken.cross_validated, |w| w.mean.expected);
        // The error expected over the workspace and the error measured at left-out postures have equal weight.
        let score = expected * left(place).sqrt();
        if best.as_ref().is_none_or(|(_, _, lowest)| score < *lowest) {
            best = Some((place, reached, score));
        }
    }
    if let Some((place, ladder_step, _)) = best {
        return Ok((place, ladder_step));
    }
    // Samples that disagree with all others are excluded whichever model is chosen.
    let begin = &recommendation.choices[0];
    let without = if step_of(steps, begin).is_some() { None } else { ladder_step(datasets, &begin.model, ground).ok() };
    Ok((0, without.filter(|ladder_step| ladder_step.calibration.unconverged().is_none())))
}

/// True if the error of a choice at left-out postures is lower than that of another by more than one standard error, in every
/// division.
fn is_surely_better(choice: &Choice, other: &Choice) -> bool {
    let error = |gain: &Gain| (gain.share / gain.sigma).abs();
    choice.gains.iter().zip(&other.gains).all(|(a, b)| a.share - b.share > error(a).max(error(b)))
}

/// Every effect of the library with the width estimated from the data, in units of the remaining noise: its prior width in a fit
/// whose residuals are weighted by the stated noise. Empty where the residual is noise, or a field of joint errors is offered.
fn library(datasets: &[NamedDataset<'_>], first: &LadderStep, ground: HoldOut<'_>) -> Vec<SizedCandidate> {
    if first.diagnosis.verdict.is_noise() || !field::knows_places_alone(datasets) {
        return Vec::new();
    }
    let examined = Library::new(datasets, &first.model);
    let noise = first.diagnosis.relevance.noise.max(f64::MIN_POSITIVE).sqrt();
    let widths = examined.candidates.iter().zip(&first.diagnosis.relevance.width);
    // A whole family is omitted, as its members are already included. So are effects whose data a check lacks, as they
    // cannot be judged there.
    let twice = |id: &str| examined.candidates.iter().any(|c| c.id.family() == id && c.id != id);
    let judged = widths.filter(|(c, _)| !twice(&c.id) && is_judged(&c.id, &first.model, ground));
    judged.map(|(c, width)| SizedCandidate { effect: c.id.clone(), width: width / noise }).collect()
}

/// True if every check contains the data that an effect needs.
fn is_judged(id: &str, model: &Model, ground: HoldOut<'_>) -> bool {
    ground.checks.iter().all(|d| {
        let balls = d.dataset.ball_ids();
        let subject = model.subject(&d.dataset.robot, &balls);
        effects::build(id, &subject).is_ok_and(|e| missing(e.as_ref(), d.dataset, model, Use::All).is_none())
    })
}
