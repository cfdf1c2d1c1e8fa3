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

/// Names in a sentence: `1, 2 and 3`.
pub(crate) fn enumerated(names: &[String]) -> String {
    match names {
        [rest @ .., last] if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        names => names.concat(),
    }
}

/// The first few of many in a sentence: `p1, p2, p3 and 4 more`.
#[must_use]
pub fn few_of(all: &[impl AsRef<str>]) -> String {
    /// Number that is named.
    const MOST: usize = 3;
    let few: Vec<&str> = all.iter().take(MOST).map(AsRef::as_ref).collect();
    let more = if all.len() > MOST { format!(" and {} more", all.len() - MOST) } else { String::new() };
    few.join(", ") + &more
}

/// The same text with an initial capital.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().to_string() + letters.as_str())
}
