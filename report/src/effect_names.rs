//! Effects as sentences name them: in words, with the id that a model accepts beside.

use calibench::effects::in_words;

/// An effect in a sentence: `gear ripple of joint 2, 17 per turn (harmonic:2:17)`.
#[must_use]
pub fn called(id: &str) -> String {
    let words = in_words(id);
    // An effect of a user's own has no other name.
    if words == id { words } else { format!("{words} ({id})") }
}

/// Several effects in a sentence.
pub(super) fn all_called<'a>(ids: impl IntoIterator<Item = &'a String>) -> String {
    ids.into_iter().map(|id| called(id)).collect::<Vec<_>>().join("; ")
}

/// The effects of one step in a sentence.
#[must_use]
pub fn each_called(ids: &[String]) -> String {
    ids.iter().map(|id| called(id)).collect::<Vec<_>>().join(" and ")
}

/// The same text with an initial capital.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().to_string() + letters.as_str())
}
