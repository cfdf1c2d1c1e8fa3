//! One step of a hunt: an effect, given by its id, added to a fitted model.

use calibench::diagnosis::Examination;
use calibench::diagnosis::additions::{Addition, Over};
use calibench::diagnosis::hypotheses::place;
use calibench::effects::{self, EffectError, EffectId, Subject};
use calibench::files::nearest_name;
use calibench::identify::Model;
use calibench::identify::calibration::IdentifyError;
use calibench::identify::problem::Use;
use calibench::measure::dataset::NamedDataset;
use calibench::robot::JointKind;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{LadderStep, step};
use thiserror::Error;

/// The reason why a step cannot be taken.
#[derive(Debug, Error)]
pub enum StepError {
    /// The effect does not exist or does not apply to these data.
    #[error("{0}")]
    Effect(String),
    /// The data do not determine the effect.
    #[error(transparent)]
    Data(IdentifyError),
    /// The model before the step, or the curve to be added, does not match these data.
    #[error(transparent)]
    Model(IdentifyError),
}

/// The effect to be added.
pub enum Wanted {
    /// An effect, possibly without its place.
    Effect(String),
    /// The error of a joint, counted from 0, as a function of one variable or two.
    Shape {
        /// The joint.
        joint: usize,
        /// What its error follows.
        over: Over,
    },
}

impl Wanted {
    /// Parses an id: an effect as listed by `effects`, one without its place, `curve:J:VARIABLE` or `curve:J:V:W`.
    ///
    /// # Errors
    /// If this robot has no such effect, these data have no such ball or sample, or the model already contains it.
    pub fn parse(id: &str, model: &Model, datasets: &[NamedDataset<'_>]) -> Result<Self, StepError> {
        let wrong = |why: String| StepError::Effect(why);
        let Some(dataset) = datasets.first().map(|d| d.dataset) else {
            return Err(wrong("there are no data to add it to".into()));
        };
        let joints = dataset.robot.joints();
        if let Some(rest) = id.strip_prefix("curve:") {
            let (joint, variable) = rest.split_once(':').unwrap_or((rest, ""));
            let joint = joint.parse::<usize>().ok().filter(|j| (1..=joints).contains(j));
            if let Some(joint) = joint.filter(|j| dataset.robot.kind(j - 1) == JointKind::Prismatic) {
                return Err(wrong(format!("joint {joint} is prismatic, and curves are of joints that turn")));
            }
            return match (joint, Over::parse(variable, &dataset.robot)) {
                (Some(joint), Some(over)) => Ok(Wanted::Shape { joint: joint - 1, over }),
                _ => Err(wrong(format!(
                    "effect '{id}' is not a curve; write curve:J:VARIABLE with a joint from 1 to {joints} and one of q1 ... q{joints}, q2+q3, tau1 ... tau{joints}, time_s, or with two of them, as curve:3:q2:q4"
                ))),
            };
        }
        if model.lists(id) {
            return Err(wrong(format!("effect '{id}' is in the model already")));
        }
        let balls = dataset.ball_ids();
        let fitted = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s)));
        let samples: Vec<String> = fitted.map(|s| s.id.clone()).collect();
        let subject = Subject { samples: Some(&samples), ..model.subject(&dataset.robot, &balls) };
        let unplaced = unplaced(&subject);
        if !unplaced.iter().any(|u| u == id) {
            effects::build(id, &subject).map_err(|e| wrong(explained(&e, id, &subject, &unplaced)))?;
        }
        Ok(Wanted::Effect(id.to_owned()))
    }

    /// The model with the effect, and the effect's id in it; an effect without a place gets the one that fits best.
    ///
    /// # Errors
    /// If the effect does not apply to these data, or they do not determine the model without it.
    pub fn wider(&self, datasets: &[NamedDataset<'_>], model: &Model) -> Result<(Model, String), StepError> {
        match self {
            Wanted::Effect(id) => {
                let wrong = |why: String| StepError::Effect(format!("effect '{id}': {why}"));
                // Most ids state their place, so the data need not be searched for it.
                let subject_balls = datasets[0].dataset.ball_ids();
                let subject = model.subject(&datasets[0].dataset.robot, &subject_balls);
                let placed = if unplaced(&subject).iter().any(|u| u == id) {
                    let examination = Examination::new(datasets, model).map_err(StepError::Model)?;
                    place(&examination, id).map_err(|e| wrong(e.to_string()))?
                } else {
                    id.clone()
                };
                Ok((model.with(&placed), placed))
            }
            Wanted::Shape { joint, over } => {
                let wrong = |why: String| StepError::Effect(format!("effect 'curve:{}:{over}': {why}", joint + 1));
                let examination = Examination::new(datasets, model).map_err(StepError::Model)?;
                let shape = Addition::shape(&examination, *joint, *over).map_err(|e| wrong(e.to_string()))?;
                let shape = shape.ok_or_else(|| wrong(format!("{over} does not vary in these data, or is not known")))?;
                if model.lists(&shape.name) {
                    return Err(wrong(format!("the model contains it already, as '{}'", shape.name)));
                }
                Ok((shape.added_to(model), shape.name.to_string()))
            }
        }
    }

    /// Adds the effect to the model of `before`, refits and judges it.
    ///
    /// # Errors
    /// If the effect does not apply to these data, or they do not determine it.
    pub fn take(
        &self,
        datasets: &[NamedDataset<'_>],
        before: &LadderStep,
        ground: HoldOut<'_>,
    ) -> Result<LadderStep, StepError> {
        let (wider, added) = self.wider(datasets, &before.model)?;
        let wrong = match self {
            Wanted::Effect(_) => StepError::Data,
            Wanted::Shape { .. } => StepError::Model,
        };
        step(datasets, before, &wider, vec![added.into()], ground).map_err(wrong)
    }
}

/// Ids without the place that a scan finds.
fn unplaced(subject: &Subject<'_>) -> Vec<String> {
    let scanned = subject.registry.families().flat_map(|f| f.scanned(subject, ""));
    scanned.map(|id| id.trim_end_matches(':').to_owned()).collect()
}

/// Explains why an effect does not exist and suggests the nearest id.
fn explained(error: &EffectError, id: &str, subject: &Subject<'_>, unplaced: &[String]) -> String {
    let all = effects::registry::ids(subject);
    let families = || subject.registry.families().map(|f| f.id);
    let known = all.iter().chain(unplaced).map(String::as_str).chain(families());
    let nearest = nearest_name(id, known).or_else(|| nearest_name(EffectId::new(id).family(), families()));
    if let EffectError::Argument { .. } = error {
        let form = subject.registry.family(id).map(|f| format!("; write `{}{}`", f.id, f.arguments));
        return format!("{error}{}", form.unwrap_or_default());
    }
    match nearest {
        Some(near) if near != id => format!("{error}; did you mean `{near}`?"),
        _ => error.to_string(),
    }
}
