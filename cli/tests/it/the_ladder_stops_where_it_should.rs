//! `ladder`: one missing effect is one step; a campaign not included in the fit is judged at every step and can refuse one; the
//! recommended model is the better one at unfitted poses.

use std::fs;
use std::path::Path;

use crate::program::{calibench, done, json, run_of, scenario};
use serde_json::Value;

fn ladder(folder: &Path, arguments: &[&str]) -> Value {
    json(folder, &[&["ladder", "--json"], arguments].concat())
}

fn mean(folder: &Path, model: &str) -> f64 {
    let arguments = ["identify", "run/trical", "--model", model, "-o", "calibration.toml"];
    assert!(calibench(folder, &arguments).status.success());
    let judged = calibench(folder, &["validate", "calibration.toml", "run/validation", "--json"]);
    let judged: Value = serde_json::from_slice(&judged.stdout).unwrap();
    judged["mean_mm"].as_f64().unwrap()
}

#[test]
fn one_missing_effect_is_one_rung() {
    let folder = run_of("moved-ball.toml");
    let output = calibench(folder.path(), &["ladder", "run/trical", "-o", "model.toml"]);
    let (said, told) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{told}");
    assert!(told.contains("(ball:3): residual of the fit") && said.contains("+ ball:3"), "{told}\n{said}");
    assert!(said.contains("the residual is noise") && said.contains("Use the last step"), "{said}");
    let model = fs::read_to_string(folder.path().join("model.toml")).unwrap();
    assert!(model.contains("\"ball:3\"]"), "{model}");
    fs::write(folder.path().join("paper.toml"), "effects = [\"base_frame\", \"mdh\", \"joint_compliance\"]").unwrap();
    let (before, after) = (mean(folder.path(), "paper.toml"), mean(folder.path(), "model.toml"));
    // 29 um of each is tracker noise.
    assert!(after < 0.5 * before && after < 0.04, "{before} to {after}");
}

#[test]
fn a_campaign_that_was_not_fitted_can_refuse_a_step() {
    let folder = run_of("paper.toml");
    let at = folder.path();
    let v = ladder(at, &["run/trical", "--check", "run/validation", "-o", "model.toml"]);
    assert_eq!(v["format"], "calibench-ladder/3");
    let steps = v["rungs"].as_array().unwrap();
    assert!(steps.len() >= 2 && steps[1]["added"][0] == "harmonic1:1", "{v}");
    for pair in steps.windows(2) {
        let errors = |r: &Value| r["checks"][0]["errors"]["rms_mm"].as_f64().unwrap();
        assert!(errors(&pair[1]) <= 1.01 * errors(&pair[0]));
        assert!(pair[1]["cross_validated_mm"].as_f64() < pair[0]["cross_validated_mm"].as_f64());
    }
    assert_eq!(v["stopped"]["because"], "no_step_helps");
    let refused = v["stopped"]["tried"].as_array().unwrap();
    let because = |o: &Value| o.as_str().unwrap().contains("'validation', which was not fitted, gets worse");
    assert!(refused.iter().any(|t| t["objections"].as_array().unwrap().iter().any(because)), "{v}");
    // The paper's robot has many ordinary errors: added step by step or all at once, whichever the unfitted campaign confirms.
    let is_recommended = |step: &&Value| step["effects"] == v["recommended"]["model"];
    let recommended = steps.iter().chain([&v["other"]]).find(is_recommended).expect("the recommended model is fitted");
    fs::write(at.join("paper.toml"), "effects = [\"base_frame\", \"mdh\", \"joint_compliance\"]").unwrap();
    let (before, after) = (mean(at, "paper.toml"), mean(at, "model.toml"));
    assert!(after < 0.5 * before, "{before} to {after}");
    // It is a model of a hundred effects, and is examined like any other.
    let diagnosis = json(at, &["diagnose", "run/trical", "--model", "model.toml", "--json"]);
    assert!(diagnosis["verdict"].is_string(), "{diagnosis}");
    // Its own prediction may be pessimistic, but not optimistic.
    let band: Vec<f64> =
        recommended["workspace"]["mean_band_mm"].as_array().unwrap().iter().map(|b| b.as_f64().unwrap()).collect();
    assert!(after < band[1], "{after} in {band:?}");
}

#[test]
fn a_spring_of_the_wrong_sign_is_called_a_symptom() {
    let folder = tempfile::tempdir().unwrap();
    let truth = format!(
        "format = \"calibench-scenario/1\"\nextends = {:?}\nname = \"wrong-sign\"\nquestion = \"Is a negative spring spoken of?\"\n[truth.effects.joint_compliance]\nc2_mdeg_per_nm = -3.0\n",
        scenario("table8.toml")
    );
    fs::write(folder.path().join("wrong.toml"), truth).unwrap();
    done(folder.path(), &["run", "wrong.toml", "--out", "run"]);
    let v = ladder(folder.path(), &["run/trical"]);
    let symptoms = v["rungs"][0]["symptoms"].as_array().unwrap();
    assert_eq!(symptoms.len(), 1, "{symptoms:?}");
    let said = symptoms[0].as_str().unwrap();
    assert!(
        said.starts_with("c2 is negative")
            && said.contains("a symptom of something missing")
            && said.ends_with("not a spring."),
        "{said}"
    );
}
