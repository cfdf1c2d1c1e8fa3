//! A family of effects is named in its own file alone. Other sources ask for its facts, or use the constant where something is true
//! of that family only: a literal would go on compiling when the family is renamed, and would match nothing.

use std::collections::BTreeSet;

use crate::{production, production_sources, sources};

/// Where the families are.
const CATALOGUE: &str = "src/effects/catalogue";

/// Words that are also columns, kinds of samples, keys and parts of the scenery.
const WORDS: [&str; 2] = ["ball", "target"];

/// Literals that look like ids and are something else: the file, the beginning of the literal.
const OTHERS: [(&str, &str); 8] = [
    // A flag.
    ("cli/src/verbs/overwritten.rs", "mdh"),
    // Keys of `[truth.mujoco]`, and the end of a key.
    ("sim/src/ground_truth.rs", "stiffening"),
    ("sim/src/scenario/mujoco_truth.rs", "stiffening"),
    ("sim/src/scenario/check.rs", "hysteresis"),
    // Sites, `ball:x`.
    ("src/robot/sites.rs", "ball:"),
    ("src/identify/own_effects.rs", "ball:"),
    ("src/compensate/calibrated_arm.rs", "ball:"),
    ("src/effects/own.rs", "ball:"),
];

/// The string literals of a line that has no escaped quotes.
fn literals(line: &str) -> impl Iterator<Item = &str> {
    line.split('"').skip(1).step_by(2)
}

/// The ids of the families: the literals of `pub const NAME: &str` and of `id:` in the files of the catalogue.
fn families() -> BTreeSet<String> {
    let is_id = |line: &&str| {
        line.trim_start().starts_with("pub const ") && line.contains(": &str =") || line.trim_start().starts_with("id: ")
    };
    let files = sources(CATALOGUE);
    let lines = files.iter().flat_map(|(_, source)| production(source).filter(is_id));
    lines.flat_map(literals).map(str::to_owned).collect()
}

/// The literals of a source that are ids of families, or begin with one and a colon.
fn ids_in<'s>(source: &'s str, families: &'s BTreeSet<String>) -> impl Iterator<Item = &'s str> {
    let is_id = |text: &&str| {
        let (family, has_arguments) = text.split_once(':').map_or((*text, false), |(family, _)| (family, true));
        families.contains(family) && (has_arguments || !WORDS.contains(text))
    };
    production(source).flat_map(literals).filter(is_id)
}

#[test]
fn no_source_but_its_own_spells_the_id_of_a_family() {
    let families = families();
    assert!(families.len() >= 45, "{families:?}");
    let mut used = BTreeSet::new();
    let mut found = Vec::new();
    let elsewhere = |(path, _): &(String, String)| !path.starts_with(CATALOGUE) && !path.contains("/benches/");
    for (path, source) in production_sources().chain(sources("tests/fuzz/src")).filter(elsewhere) {
        for id in ids_in(&source, &families) {
            match OTHERS.iter().find(|(file, start)| path == *file && id.starts_with(start)) {
                Some(other) => _ = used.insert(*other),
                None => found.push(format!("{path}: {id}")),
            }
        }
    }
    assert!(found.is_empty(), "ask for a fact of the family, or use its constant in `EffectId`: {found:#?}");
    let unused: Vec<_> = OTHERS.iter().filter(|other| !used.contains(*other)).collect();
    assert!(unused.is_empty(), "no longer there: {unused:?}");
}

#[test]
fn an_id_is_found_with_its_arguments_and_without() {
    let families = BTreeSet::from(["mdh".to_owned(), "ball".to_owned()]);
    let source =
        "of(&[\"base\", \"mdh\"]); format!(\"ball:{b}\"); row(\"ball\")\n// \"mdh\"\n#[cfg(test)]\nmod tests { \"mdh\" }";
    assert_eq!(ids_in(source, &families).collect::<Vec<_>>(), ["mdh", "ball:{b}"]);
}
