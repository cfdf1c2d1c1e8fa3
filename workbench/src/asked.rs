//! Requests of a page, by name, with a JSON body.

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use thiserror::Error;

use crate::bench::Bench;
use crate::own_effect::Draft;
use crate::refusal::Refusal;

/// Questions without side effects and without a body.
pub const VIEWS: [&str; 3] = ["document", "views", "progress"];

/// Everything else that can be asked; those that begin with `save-` write files.
pub const ACTIONS: [&str; 14] = [
    "candidate",
    "choose",
    "switch",
    "own",
    "undo",
    "redo",
    "recommend",
    "cancel",
    "next",
    "save-model",
    "save-calibration",
    "save-urdf",
    "save-report",
    "save-plan",
];

/// The reason why a question has no answer.
#[derive(Debug, Error)]
pub enum Unanswered {
    /// There is no such question.
    #[error("there is nothing at this address")]
    Unknown,
    /// The body is not what the question needs.
    #[error("this is not a valid request: {0}")]
    Malformed(#[from] serde_json::Error),
    /// The question was about a model that is not the present one any longer. Not a mistake, and the page need not be told: it
    /// has requested the new model already.
    #[error("the model has changed in the meantime")]
    Changed,
    /// What was requested cannot be done.
    #[error("{message}")]
    Refused {
        /// The field of the page in error, if it is one.
        field: Option<&'static str>,
        /// The reason, and the remedy.
        message: String,
    },
}

impl From<Refusal> for Unanswered {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Changed => Unanswered::Changed,
            Refusal::Field { field, message } => Unanswered::Refused { field: Some(field), message },
            other => Unanswered::Refused { field: None, message: other.to_string() },
        }
    }
}

impl Bench {
    /// Answers one of [`VIEWS`], or one of [`ACTIONS`] with its `body`.
    ///
    /// # Errors
    /// If there is no such question, its body is not as it must be, or it is refused.
    pub fn ask(&self, what: &str, body: &[u8]) -> Result<Value, Unanswered> {
        let nothing = || read::<Nothing>(body);
        Ok(match what {
            "document" => self.document()?,
            "views" => self.views()?,
            "progress" => self.progress(),
            "candidate" => self.candidate(&read::<Named>(body)?.effect)?,
            "choose" => self.choose(&read::<Chosen>(body)?.datasets)?,
            "switch" => {
                let Switched { effect, on, force } = read(body)?;
                self.switch(&effect, on, force)?
            }
            "own" => {
                let Own { name, unit, site, expressions, force } = read(body)?;
                self.own(&Draft { name, unit, site, expressions }, force)?
            }
            "undo" => nothing().map(|Nothing {}| self.turn(-1))??,
            "redo" => nothing().map(|Nothing {}| self.turn(1))??,
            "recommend" => nothing().map(|Nothing {}| self.recommend())??,
            "cancel" => nothing().map(|Nothing {}| self.cancel())?,
            "next" => nothing().map(|Nothing {}| self.next_experiment())??,
            "save-model" => nothing().map(|Nothing {}| self.save_model())??.json(),
            "save-calibration" => nothing().map(|Nothing {}| self.save_calibration())??.json(),
            "save-urdf" => nothing().map(|Nothing {}| self.save_urdf())??.json(),
            "save-report" => nothing().map(|Nothing {}| self.save_report())??.json(),
            "save-plan" => nothing().map(|Nothing {}| self.save_plan())??.json(),
            _ => return Err(Unanswered::Unknown),
        })
    }
}

fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T, Unanswered> {
    Ok(serde_json::from_slice(body)?)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Named {
    effect: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Switched {
    effect: String,
    on: bool,
    #[serde(default)]
    force: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Chosen {
    datasets: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Own {
    name: String,
    unit: String,
    site: String,
    expressions: String,
    #[serde(default)]
    force: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Nothing {}
