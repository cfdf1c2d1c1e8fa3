//! What a campaign is made under, and must still be made under when it goes on another day.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::dataset_file::description_hash;
use super::{Dataset, PlannedPose};
use crate::files::hexadecimal;

/// Named facts that must be the same when a campaign goes on: the plan, what is known of the cell, the settings.
///
/// The program's version is not among them, it is noted with every [session](super::JournalSession).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Conditions(BTreeMap<String, String>);

/// A condition that is not what it was; `None` where there was none, or is none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Changed {
    pub name: String,
    pub was: Option<String>,
    pub is: Option<String>,
}

impl Conditions {
    /// The plan `poses` and the `cell` they are of, each by its SHA-256.
    pub fn of(poses: &[PlannedPose], cell: &Dataset) -> Self {
        // A pose is numbers and names, which JSON can always hold.
        let poses = serde_json::to_string(poses).unwrap_or_default();
        Conditions(BTreeMap::new()).and_text("plan", &poses).and("cell", description_hash(cell))
    }

    /// And this one.
    #[must_use]
    pub fn and(mut self, name: &str, value: impl ToString) -> Self {
        self.0.insert(name.into(), value.to_string());
        self
    }

    /// And this text, by its SHA-256.
    #[must_use]
    pub fn and_text(self, name: &str, text: &str) -> Self {
        self.and(name, hexadecimal(&Sha256::digest(text)))
    }

    /// And every field of these settings, named `of.field`.
    #[must_use]
    pub fn and_settings(mut self, of: &str, settings: &impl Serialize) -> Self {
        if let Ok(serde_json::Value::Object(fields)) = serde_json::to_value(settings) {
            self.0.extend(fields.into_iter().map(|(field, value)| (format!("{of}.{field}"), value.to_string())));
        }
        self
    }

    /// Those that are not `now` as they were here: the plan before all others.
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
    /// Whether it is of how the arm may move alone, and not of what is measured: who says so may go on.
    pub(super) fn is_acceptable(&self) -> bool {
        self.name.starts_with("guards.") || self.name.starts_with("robot.")
    }

    /// In words.
    pub(super) fn words(&self) -> String {
        let value = |value: &Option<String>| value.clone().unwrap_or_else(|| "not given".into());
        format!("{} was {}, and is {} now", self.name, value(&self.was), value(&self.is))
    }
}
