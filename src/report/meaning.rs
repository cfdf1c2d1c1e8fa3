//! What an effect means and where to look, in the words of the shop floor.

use crate::effects::{Meaning, family};

/// What is said of an effect that no family describes.
const OWN: &str = "an effect of your own";

/// The meaning of an effect's family; of a user's own effect, nothing more than that it is one.
pub(super) fn meaning(effect: &str) -> Meaning {
    family(effect).map_or(Meaning { physics: OWN, look: "" }, |f| f.meaning)
}

/// What an effect is, as the catalogue says it.
pub(super) fn what(effect: &str) -> &'static str {
    family(effect).map_or(OWN, |f| f.what)
}
