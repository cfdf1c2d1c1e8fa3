//! Conditions of a campaign, which must be unchanged when it is resumed.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::files::hexadecimal;
use crate::measure::dataset::Dataset;
use crate::measure::dataset::file::description_hash;
use crate::measure::poses::PlannedPose;

/// Named facts that must be the same when a campaign is resumed: the plan, the description of the cell, the settings.
///
/// The program's version is not among them; it is recorded with every [session](super::journal::JournalSession).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Conditions(BTreeMap<String, String>);

/// A changed condition; `None` if it was, or now is, not given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Changed {
    pub name: String,
    pub was: Option<String>,
    pub is: Option<String>,
}

impl Conditions {
    /// The plan `poses` and its `cell`, each by its SHA-256.
    pub fn of(poses: &[PlannedPose], cell: &Dataset) -> Self {
        // A pose consists of numbers and names, which JSON can always represent.
        let poses = serde_json::to_string(poses).unwrap_or_default();
        Conditions(BTreeMap::new()).and_text("plan", &poses).and("cell", description_hash(cell))
    }

    /// Adds this condition.
    #[must_use]
    pub fn and(mut self, name: &str, value: impl ToString) -> Self {
        self.0.insert(name.into(), value.to_string());
        self
    }

    /// Adds this text, by its SHA-256.
    #[must_use]
    pub fn and_text(self, name: &str, text: &str) -> Self {
        self.and(name, hexadecimal(&Sha256::digest(text)))
    }

    /// Adds every field of these settings, named `of.field`.
    #[must_use]
    pub fn and_settings(mut self, of: &str, settings: &impl Serialize) -> Self {
        if let Ok(serde_json::Value::Object(fields)) = serde_json::to_value(settings) {
            self.0.extend(fields.into_iter().map(|(field, value)| (format!("{of}.{field}"), value.to_string())));
        }
        self
    }

    /// The conditions that differ in `now`, the plan first.
    pub(super) fn changed(&self, now: &Conditions) -> Vec<Changed> {
        let mut names: Vec<&String> = self.0.keys().chain(now.0.keys()).collect();
        names.sort_by_key(|name| (*name != "plan", *name));
        names.dedup();
        let differs = |name: &&String| self.0.get(*name) != now.0.get(*name);
        let changed =
            |name: &String| Changed { name: name.clone(), was: self.0.get(name).cloned(), is: now.0.get(name).cloned() };
        names.into_iter().filter(differs).map(changed).collect()
    }
}

impl Changed {
    /// True if it concerns only the motion of the arm, not the measurement: the user may accept the change and resume.
    pub(super) fn is_acceptable(&self) -> bool {
        self.name.starts_with("guards.") || self.name.starts_with("robot.")
    }

    /// Describes the change.
    pub(super) fn words(&self) -> String {
        let value = |value: &Option<String>| value.clone().unwrap_or_else(|| "not given".into());
        format!("{} was {}, and is {} now", self.name, value(&self.was), value(&self.is))
    }
}
