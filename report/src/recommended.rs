//! The commands that a report recommends.

use std::path::{Path, PathBuf};

use calibench::files::streams::is_standard_input;

/// The arguments of recommended commands after the verb: datasets and model as given.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Recommended {
    /// Datasets, e.g. `runs/balls runs/more`.
    pub datasets: String,
    /// Model, e.g. ` --model model.toml`, with a leading blank; empty for none.
    pub model: String,
}

impl Recommended {
    /// The arguments of recommended commands after the verb.
    #[must_use]
    pub fn of(folders: &[PathBuf], model: Option<&Path>) -> Self {
        let quoted = |path: &Path| {
            if is_standard_input(path) {
                return "-".to_owned();
            }
            let text = path.display().to_string();
            let plain = text.chars().all(|c| c.is_ascii_alphanumeric() || "/._-+:".contains(c));
            if plain { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
        };
        Recommended {
            datasets: folders.iter().map(|f| quoted(f)).collect::<Vec<_>>().join(" "),
            model: model.map_or(String::new(), |m| format!(" --model {}", quoted(m))),
        }
    }

    /// The command with this verb.
    pub(super) fn verb(&self, verb: &str) -> String {
        format!("calibench {verb} {}{}", self.datasets, self.model)
    }

    /// The command that diagnoses them.
    #[must_use]
    pub fn diagnose(&self) -> String {
        self.verb("diagnose")
    }

    /// What would show more than the present data do.
    pub(super) fn more_measurements(&self) -> String {
        format!("`{}` names measurements that would add information.", self.verb("plan next"))
    }

    pub(super) fn add(&self, effect: &str) -> String {
        self.verb(&format!("add {effect}"))
    }
}
