//! The meaning of an effect and where to look for it, in shop-floor terms.

use calibench::effects::facts::Meaning;
use calibench::effects::registry::family;

/// Description of an effect that belongs to no family.
const OWN: &str = "a user-defined effect";

/// The meaning of an effect's family; for a user-defined effect, only that it is one.
pub(super) fn meaning(effect: &str) -> Meaning {
    family(effect).map_or(Meaning { physics: OWN, look: "" }, |f| f.meaning)
}

/// The description of an effect in the catalogue.
pub fn what(effect: &str) -> &'static str {
    family(effect).map_or(OWN, |f| f.what)
}
