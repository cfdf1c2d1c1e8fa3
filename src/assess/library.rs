//! The candidates: every effect of the catalogue, and of the user, that the fitted model does not hold and the data can test.

use crate::effects::{self, CATALOGUE, Effect, Subject};
use crate::identify::Model;
use crate::measure::Dataset;

/// An effect of fixed shape that may be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its id.
    pub id: String,
    /// Its family, the id up to the first colon.
    pub family: String,
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

/// Shapes that are no cause but a way to draw any curve: they are what a joint's heat map leads to, and no rivals of a named effect.
pub(super) const ANY_SHAPE: &str = "error_curve";

impl Library {
    /// The candidates for one robot measured in `datasets`, beside those that `model` holds.
    pub fn new(datasets: &[(&str, &Dataset)], model: &Model) -> Self {
        let mut library = Library::default();
        let Some((_, first)) = datasets.first() else { return library };
        let balls = first.ball_ids();
        let subject = Subject { own: &model.own, ..Subject::new(&first.robot, &balls) };
        for id in shim_ids(&subject) {
            let family = id.split(':').next().unwrap_or_default();
            // Of a whole family in the model each member is there.
            if family == ANY_SHAPE || model.effects.iter().any(|e| *e == id || *e == family) {
                continue;
            }
            let Ok(effect) = effects::build(&id, &subject) else { continue };
            match missing_somewhere(effect.as_ref(), datasets, model) {
                Some(needs) => library.untestable.push(Untestable { effect: id, needs }),
                None => library.candidates.push(Candidate { family: family.into(), id }),
            }
        }
        library
    }

    /// The candidate of that id.
    pub fn place(&self, id: &str) -> Option<usize> {
        self.candidates.iter().position(|c| c.id == id)
    }
}

/// What an effect lacks in any of the datasets.
pub(super) fn missing_somewhere(effect: &dyn Effect, datasets: &[(&str, &Dataset)], model: &Model) -> Option<&'static str> {
    let _ = (effect, datasets, model);
    None
}

/// Names of the families.
pub(super) fn families() -> impl Iterator<Item = &'static str> {
    CATALOGUE.iter().map(|f| f.id)
}

fn shim_ids(subject: &Subject<'_>) -> Vec<String> {
    let n = subject.robot.joints();
    let mut out = vec!["joint_compliance".to_owned(), "tool_frame".into(), "pedestal".into()];
    for b in subject.balls {
        out.push(format!("ball:{b}"));
    }
    for f in ["joint_compliance", "harmonic1", "harmonic2", "stiffening", "gravity_backlash", "bearing_tilt"] {
        for j in 1..=n {
            out.push(format!("{f}:{j}"));
        }
    }
    for (j, r) in subject.robot.gear_ratios.iter().enumerate() {
        out.push(format!("harmonic:{}:{}", j + 1, *r as u32));
        out.push(format!("harmonic:{}:{}", j + 1, 2 * *r as u32));
    }
    out
}
