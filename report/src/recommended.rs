//! The commands that a report recommends.

/// The arguments of recommended commands after the verb: datasets and model as given.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Recommended {
    /// Datasets, e.g. `runs/balls runs/more`.
    pub datasets: String,
    /// Model, e.g. ` --model model.toml`, with a leading blank; empty for none.
    pub model: String,
}

impl Recommended {
    pub(super) fn verb(&self, verb: &str) -> String {
        format!("`calibench {verb} {}{}`", self.datasets, self.model)
    }

    /// The command that diagnoses them.
    #[must_use]
    pub fn diagnose(&self) -> String {
        self.verb("diagnose")
    }

    pub(super) fn add(&self, effect: &str) -> String {
        self.verb(&format!("add {effect}"))
    }
}
