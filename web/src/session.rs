//! Data that are open on one page.

use std::path::Path;

use calibench::files::disk::write_whole;
use calibench_workbench::{Bench, Unanswered};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::host::Host;
use crate::opening::{NotOpened, OpenRequest, open};
use crate::play::{PlayRequest, hidden_choices, play};

/// A page's work: nothing at first, then a workbench on what was opened last.
pub struct Session {
    bench: Option<Bench>,
    host: Host,
}

/// The reason why a question has no answer.
#[derive(Debug, thiserror::Error)]
pub enum NoAnswer {
    /// The files were not opened.
    #[error("{because}")]
    Opening {
        /// The reason.
        because: NotOpened,
        /// Interpretation of the files.
        told: Value,
    },
    /// The workbench does not answer it.
    #[error(transparent)]
    Bench(#[from] Unanswered),
    /// The body is not what the question needs.
    #[error("this is not a valid request: {0}")]
    Malformed(#[from] serde_json::Error),
    /// Nothing is open.
    #[error("open measurements first")]
    NothingOpen,
}

impl From<NotOpened> for NoAnswer {
    fn from(because: NotOpened) -> Self {
        NoAnswer::Opening { because, told: Value::Null }
    }
}

impl NoAnswer {
    /// The field of the page in error.
    #[must_use]
    pub fn field(&self) -> Option<&str> {
        match self {
            NoAnswer::Bench(Unanswered::Refused { field, .. }) => *field,
            NoAnswer::Opening { because, .. } => because.field(),
            _ => None,
        }
    }

    /// Interpretation of files that were not opened.
    #[must_use]
    pub fn told(&self) -> Option<&Value> {
        match self {
            NoAnswer::Opening { told, .. } => Some(told),
            _ => None,
        }
    }

    /// True if it was asked of a model that is no longer the present one.
    #[must_use]
    pub fn is_of_earlier_model(&self) -> bool {
        matches!(self, NoAnswer::Bench(Unanswered::Changed))
    }
}

impl Session {
    /// A page on which nothing is open.
    #[must_use]
    pub fn new(host: Host) -> Self {
        Session { bench: None, host }
    }

    /// Answers a question of the page: `choices` lists the robots and what a simulated one can hide, `open` opens files, `play`
    /// measures a simulated robot, anything else is asked of the workbench.
    ///
    /// # Errors
    /// If files cannot be used, nothing is open, or the workbench refuses.
    pub fn ask(&mut self, what: &str, body: &[u8]) -> Result<Value, NoAnswer> {
        let mut told = json!({});
        let opened = match what {
            "choices" => return Ok(hidden_choices()),
            "open" => open(&serde_json::from_slice::<OpenRequest>(body)?, self.host, &mut told)
                .map_err(|because| NoAnswer::Opening { because, told })?,
            "play" => play(&serde_json::from_slice::<PlayRequest>(body)?, self.host)?,
            "adopt" => return self.adopt(&serde_json::from_slice::<Adopted>(body)?),
            _ => return Ok(self.bench.as_ref().ok_or(NoAnswer::NothingOpen)?.ask(what, body)?),
        };
        self.bench = Some(opened.bench.telling(self.host.tell));
        Ok(json!({"opened": opened.told}))
    }

    /// Goes on to a model that this workbench was at before the page had to begin again.
    fn adopt(&self, Adopted { model }: &Adopted) -> Result<Value, NoAnswer> {
        let bench = self.bench.as_ref().ok_or(NoAnswer::NothingOpen)?;
        let path = Path::new("adopted.toml");
        write_whole(path, model.as_bytes()).map_err(NotOpened::from)?;
        let model = bench.read_model(path).map_err(NotOpened::from)?;
        Ok(bench.adopt(&model).map_err(Unanswered::from)?)
    }
}

/// The text of a model file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Adopted {
    model: String,
}
