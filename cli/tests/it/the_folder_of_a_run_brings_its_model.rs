//! The folder of a run stands for its data, and these bring the model of the run: nobody is told that nothing is missing because
//! another model was taken.

use crate::program::{calibench, json, run_of};

#[test]
fn a_diagnosis_of_a_run_is_that_of_its_model() {
    let folder = run_of("compliance-missing.toml");
    let at = folder.path();
    let given = json(at, &["diagnose", "run/trical", "--model", "run/model.toml", "--json"]);
    assert_eq!(given["set95"], serde_json::json!(["joint_compliance"]));
    for data in ["run", "run/trical"] {
        let found = json(at, &["diagnose", data, "--json"]);
        assert_eq!(found["set95"], given["set95"], "{data}");
        assert_eq!(found["residual_mm"], given["residual_mm"], "{data}");
    }
    let said = calibench(at, &["identify", "run"]);
    let told = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(told.contains("The model is that of the run, run/model.toml"), "{told}");
    // The model of the run is read, so it is not overwritten.
    let refused = calibench(at, &["ladder", "run/trical", "-o", "run/model.toml"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn the_default_model_is_said_by_nothing() {
    let folder = run_of("table8.toml");
    let said = calibench(folder.path(), &["identify", "run"]);
    assert!(said.status.success());
    assert!(!String::from_utf8_lossy(&said.stderr).contains("The model is"), "it is the default one");
}
