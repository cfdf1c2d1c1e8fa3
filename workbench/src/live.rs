//! Additions to the document that a live page needs: the switches, and the other possible actions.

use calibench::identify::calibration::Calibration;
use serde_json::{Value, json};

use crate::case::Case;
use crate::kept::CachedFit;
use crate::saving::Place;
use crate::state::State;
use crate::switches::{Switch, Switches};
use calibench_report::symptom_sentence;

/// The switches, the datasets that can be chosen, and the available actions. The candidates are null until the present model
/// is judged.
pub(super) fn live(case: &Case, place: &Place, state: &State) -> Value {
    let here = state.history.here();
    let set = state.set();
    let all = case.datasets.iter().enumerate();
    let datasets =
        all.map(|(k, (name, d))| json!({"name": name, "samples": d.samples.len(), "chosen": here.chosen.contains(&k)}));
    json!({
        "datasets": datasets.collect::<Vec<_>>(),
        "effects": here.model.effects,
        "switches": here.switches.all().iter().map(|s| switch(&here.switches, s, set)).collect::<Vec<_>>(),
        "candidates": set.and_then(|s| s.page_model()).map(|p| p.candidates()),
        "sites": set.map_or_else(Vec::new, |s| sites(&s.scores.calibration)),
        "can_undo": state.history.away(-1).is_some(),
        "can_redo": state.history.away(1).is_some(),
        "saves_to": place.folder().display().to_string(),
    })
}

/// A switch, with a flag for each of its parameters outside its physical range.
fn switch(switches: &Switches, switch: &Switch, set: Option<&CachedFit>) -> Value {
    let symptoms = set.iter().flat_map(|s| &s.scores.symptoms).filter(|s| switch.on && s.effect == switch.effect);
    json!({
        "effect": switch.effect,
        "asked": switch.asked,
        "words": switches.words(&switch.effect),
        "on": switch.on,
        "initial": switch.initial,
        "flags": symptoms.map(symptom_sentence).collect::<Vec<_>>(),
    })
}

/// The sites of a user-defined effect.
fn sites(calibration: &Calibration) -> Vec<String> {
    let joints = calibration.robot.joints();
    let each = |from: usize, site: &'static str| (from..from + joints).map(move |j| format!("{site}:{j}"));
    each(1, "theta").chain(each(1, "d")).chain(each(0, "alpha")).chain(each(0, "a")).collect()
}
