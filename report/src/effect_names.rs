//! Effects as sentences name them: in words, with the id that a model accepts beside.

use calibench::effects::registry::Registry;

/// An effect in a sentence: `gear ripple of joint 2, 17 per turn (harmonic:2:17)`.
#[must_use]
pub fn called(registry: &Registry, id: &str) -> String {
    let words = registry.in_words(id);
    // An effect of a user's own has no other name.
    if words == id { words } else { format!("{words} ({id})") }
}

/// Several effects in a sentence.
pub fn all_called<'a, Id: AsRef<str> + 'a>(registry: &Registry, ids: impl IntoIterator<Item = &'a Id>) -> String {
    ids.into_iter().map(|id| called(registry, id.as_ref())).collect::<Vec<_>>().join("; ")
}

/// The effects of one step in a sentence.
#[must_use]
pub fn each_called<Id: AsRef<str>>(registry: &Registry, ids: &[Id]) -> String {
    ids.iter().map(|id| called(registry, id.as_ref())).collect::<Vec<_>>().join(" and ")
}

/// The same text with an initial capital.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().to_string() + letters.as_str())
}
