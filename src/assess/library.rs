//! The candidates: every effect of the catalogue, and of the user, that the fitted model does not hold and the data can test.

use crate::effects::{self, Effect, EffectId, Role};
use crate::identify::{Model, Use, missing};
use crate::measure::Dataset;
use crate::robot::Robot;

/// An effect of fixed shape that may be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its id.
    pub id: String,
    /// Its family, the id up to the first colon.
    pub family: String,
}

impl Candidate {
    /// Of that id.
    pub fn new(id: String) -> Self {
        Candidate { family: EffectId::new(&id).family().to_owned(), id }
    }
}

/// An effect that these data cannot test.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Untestable {
    /// Its id.
    pub effect: String,
    /// What is missing.
    pub needs: &'static str,
}

/// What may be missing in a model of these data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Library {
    /// Effects that can be tested, in the order of the catalogue.
    pub candidates: Vec<Candidate>,
    /// Effects that cannot, and why.
    pub untestable: Vec<Untestable>,
}

/// A family that is a candidate as a whole too: gearboxes of one make are all compliant, if one is.
const WHOLE: &str = "joint_compliance";

impl Library {
    /// The candidates for one robot measured in `datasets`, beside those that `model` holds.
    pub fn new(datasets: &[(&str, &Dataset)], model: &Model) -> Self {
        let mut library = Library::default();
        let Some((_, first)) = datasets.first() else { return library };
        let balls = first.ball_ids();
        let subject = model.subject(&first.robot, &balls);
        let whole = (!model.effects.iter().any(|e| EffectId::new(e).family() == WHOLE)).then(|| WHOLE.to_owned());
        for id in whole.into_iter().chain(effects::ids(&subject)).chain(gear_ripple(&first.robot)) {
            let Some(candidate) = candidate(id, model) else { continue };
            let Ok(effect) = effects::build(&candidate.id, &subject) else { continue };
            match missing_somewhere(effect.as_ref(), datasets, model) {
                Some(needs) => library.untestable.push(Untestable { effect: candidate.id, needs }),
                None => library.candidates.push(candidate),
            }
        }
        library
    }

    /// Every candidate for a robot that measures everything: what may be hidden in it.
    pub fn of_robot(cell: &Dataset, model: &Model) -> Self {
        let balls = cell.ball_ids();
        let subject = model.subject(&cell.robot, &balls);
        let ids = effects::ids(&subject).into_iter().chain(gear_ripple(&cell.robot)).filter_map(|id| candidate(id, model));
        Library { candidates: ids.collect(), untestable: Vec::new() }
    }

    /// The candidate of that id.
    pub fn place(&self, id: &str) -> Option<usize> {
        self.candidates.iter().position(|c| c.id == id)
    }
}

/// Ripple of gears of known ratio, once and twice per turn of the wave generator: where it is to be expected, it needs no scan.
fn gear_ripple(robot: &Robot) -> Vec<String> {
    let of_joint = |(j, ratio): (usize, &f64)| [1.0, 2.0].map(|k| format!("harmonic:{}:{}", j + 1, (k * ratio).round()));
    robot.gear_ratios.iter().enumerate().flat_map(of_joint).collect()
}

/// An effect as a candidate beside a model; `None` when it is no hypothesis, or the model holds it.
fn candidate(id: String, model: &Model) -> Option<Candidate> {
    // A shape that draws any curve is what a joint's heat map leads to, and no rival of a named effect.
    let any_shape = model.family(&id).is_some_and(|f| f.role == Role::AnyShape);
    (!any_shape && !model.holds(&id)).then(|| Candidate::new(id))
}

/// What an effect lacks in any of the datasets.
pub(super) fn missing_somewhere(effect: &dyn Effect, datasets: &[(&str, &Dataset)], model: &Model) -> Option<&'static str> {
    datasets.iter().find_map(|(_, d)| missing(effect, d, model, Use::Fit))
}
