//! The meaning of an effect and what to do about it, in shop-floor terms.

use calibench::effects::facts::{Intervention, Meaning};
use calibench::effects::registry::Registry;

/// Description of an effect that belongs to no family.
const OWN: &str = "a user-defined effect";

/// The meaning of an effect's family; for a user-defined effect, only that it is one.
pub(super) fn meaning(registry: &Registry, effect: &str) -> Meaning {
    registry.family(effect).map_or(Meaning { physics: OWN, intervention: Intervention::IN_THE_MODEL }, |f| f.meaning)
}

/// What to do about an effect, how to verify it, and what happens otherwise, as sentences; none if it is corrected in the model.
#[must_use]
pub fn intervention_words(intervention: &Intervention) -> Vec<String> {
    if intervention.act.is_empty() {
        return Vec::new();
    }
    vec![
        format!("Do: {}.", intervention.act),
        format!("Verify: {}.", intervention.verify),
        format!("If nothing is done: {}.", intervention.work.if_nothing_is_done()),
    ]
}

/// The description of an effect's family; for a user-defined effect, only that it is one.
pub fn what(registry: &Registry, effect: &str) -> &'static str {
    registry.family(effect).map_or(OWN, |f| f.what)
}
