//! `discover`: the law of a hidden flaw is printed, written as an effect of a model that other verbs read, and the same in the document
//! as on the screen; without one nothing is written.

use std::fs;

use calibench_report::documents::Discovery;
use serde_json::Value;

use crate::program::{calibench, run_of};

#[test]
fn a_hose_at_the_wrist_becomes_an_effect_of_the_model() {
    let folder = run_of("blind-cable-spring.toml");
    let at = folder.path();
    let printed = calibench(at, &["discover", "run/trical", "-o", "model.toml"]);
    let text = String::from_utf8(printed.stdout).unwrap();
    assert_eq!(printed.status.code(), Some(0), "{text}");
    assert!(text.contains("law_1: Joint 5 turns too far by "), "{text}");
    let model = fs::read_to_string(at.join("model.toml")).unwrap();
    assert!(model.contains("name = \"law_1\"") && model.contains("site = \"theta:5\""), "{model}");

    let json = calibench(at, &["discover", "run/trical", "--json"]);
    let document: Discovery = serde_json::from_slice(&json.stdout).unwrap();
    // Sentences are wrapped on the screen.
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    for sentence in document.laws.iter().flat_map(|law| &law.sentences) {
        assert!(words(&text).contains(&words(sentence)), "{sentence}: {text}");
    }
    let step = document.step.unwrap();
    assert!(step.accepted && step.after.cross_validated_mm < 0.5 * step.before.cross_validated_mm, "{step:?}");
    assert_eq!(step.after.added, document.laws.iter().map(|law| law.name.clone()).collect::<Vec<_>>());

    // Whoever fits the model gets the residual that the search told.
    let fitted = calibench(at, &["identify", "run/trical", "--model", "model.toml", "--json"]);
    let fitted: Value = serde_json::from_slice(&fitted.stdout).unwrap();
    let residual = fitted["residual_mm"].as_f64().unwrap();
    assert!((residual - step.after.residual_mm).abs() < 1e-3 * residual, "{residual} {}", step.after.residual_mm);
    // A second search begins where the first ended, and takes no name twice.
    let again = calibench(at, &["discover", "run/trical", "--model", "model.toml", "--json"]);
    let again: Discovery = serde_json::from_slice(&again.stdout).unwrap();
    assert!(again.laws.iter().all(|law| document.laws.iter().all(|old| old.name != law.name)));
}

#[test]
fn a_robot_without_a_law_has_none() {
    let folder = run_of("paper.toml");
    let at = folder.path();
    let printed = calibench(at, &["discover", "run/tracker", "-o", "model.toml"]);
    let text = String::from_utf8(printed.stdout).unwrap();
    assert_eq!(printed.status.code(), Some(0), "{text}");
    assert!(!text.contains("law_1"), "{text}");
    let refused = calibench(at, &["discover", "run/trical", "-o", "run/trical/samples.csv"]);
    assert_eq!(refused.status.code(), Some(2));
}
