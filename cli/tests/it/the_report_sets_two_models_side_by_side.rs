//! A report with a second model prefers one only by rows that neither was fitted to; and its view in space shows the page's residuals.

use std::fs;

use crate::program::{calibench, json, run_of};
use serde_json::Value;

/// Drawn numbers have six digits, arrows a tenth of a micrometre.
const DRAWN: f64 = 1e-4;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn length(value: &Value) -> f64 {
    value.as_array().unwrap().iter().map(|x| number(x).powi(2)).sum::<f64>().sqrt()
}

#[track_caller]
fn near(a: f64, b: f64, within: f64) {
    assert!((a - b).abs() <= within, "{a} and {b}");
}

#[test]
fn the_error_at_poses_that_were_not_fitted_decides_and_nothing_else() {
    let folder = run_of("gear-ripple.toml");
    let at = folder.path();
    let own = r#"effects = ["base_frame", "mdh", "joint_compliance"]"#;
    fs::write(at.join("own.toml"), own).unwrap();
    fs::write(at.join("ripple.toml"), own.replace(']', r#", "harmonic:3:202"]"#)).unwrap();
    fs::write(at.join("poor.toml"), r#"effects = ["base_frame"]"#).unwrap();

    // The ripple that is in the robot is preferred, by the difference of the two means that the page shows.
    let page = json(at, &["report", "run", "--against", "ripple.toml", "--json"]);
    let against = &page["against"];
    let paired = &against["paired"];
    assert_eq!(paired["better"], "ripple.toml");
    assert!(number(&paired["difference_mm"]).abs() > number(&paired["two_errors_mm"]), "{paired}");
    let mean = |figures: &Value| number(&figures["validation"]["mean_mm"]);
    near(number(&paired["difference_mm"]), mean(&against["figures"]) - mean(&page["figures"]), DRAWN);
    assert!(against["sentence"].as_str().unwrap().starts_with("Better on rows not fitted: ripple.toml."), "{against}");

    // `compare` says the same of the same rows, in the same words.
    let compared = json(at, &["compare", "own.toml", "ripple.toml", "run/trical", "run/validation", "--json"]);
    let [own_file, second] = [&compared["calibrations"][0], &compared["calibrations"][1]];
    assert_eq!((&compared["judged_on"], &second["difference"]["better"]), (&"held_out".into(), &"ripple.toml".into()));
    near(number(&second["difference"]["mean_mm"]), number(&second["mean_mm"]) - number(&own_file["mean_mm"]), 1e-12);

    // Without such rows each fitted row judges that was left out of a fit, however small the residual.
    let fitted_alone = json(at, &["report", "run/trical", "--model", "poor.toml", "--against", "ripple.toml", "--json"]);
    let against_poor = &fitted_alone["against"];
    assert_eq!(against_poor["paired"]["better"], "ripple.toml");
    let sentence = against_poor["sentence"].as_str().unwrap();
    assert!(sentence.starts_with("Better on rows left out of the fit in turn: ripple.toml."), "{sentence}");
    let alone = json(at, &["compare", "poor.toml", "ripple.toml", "run/trical", "--json"]);
    let difference = &alone["calibrations"][1]["difference"];
    assert_eq!((&alone["judged_on"], difference["sentence"].as_str().unwrap()), (&"left_out".into(), sentence));
    near(number(&difference["mean_mm"]), number(&against_poor["paired"]["difference_mm"]), DRAWN);

    // A model against itself differs in nothing.
    let same = json(at, &["report", "run", "--against", "own.toml", "--json"]);
    assert_eq!(same["against"]["paired"]["better"], Value::Null);
    near(number(&same["against"]["paired"]["difference_mm"]), 0.0, DRAWN);
    assert_eq!(same["against"]["arrows_um"], same["residuals"]["space"]["arrows_um"]);

    in_space(&page);

    // A second model that is none ends in one line that names it, and no page.
    fs::write(at.join("broken.toml"), r#"effects = ["base_frame", "nonsense"]"#).unwrap();
    let refused = calibench(at, &["report", "run", "--against", "broken.toml", "-o", "page.html"]);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!((refused.status.code(), said.trim_end().lines().count()), (Some(2), 1), "{said}");
    assert!(said.contains("broken.toml") && said.contains("nonsense") && !at.join("page.html").exists(), "{said}");
}

/// The arrows are the residuals, turned into the axes of the base; every arm ends at its ball; the maps hold every sample once.
fn in_space(page: &Value) {
    let residuals = &page["residuals"];
    let (samples, space) = (residuals["samples"].as_array().unwrap(), &residuals["space"]);
    let (arms, arrows) = (space["arms_mm"].as_array().unwrap(), space["arrows_um"].as_array().unwrap());
    assert_eq!((arms.len(), arrows.len()), (samples.len(), samples.len()));
    for ((sample, arm), arrow) in samples.iter().zip(arms).zip(arrows) {
        near(length(arrow), number(&sample["length_um"]), 0.2);
        let chain: Vec<f64> = arm.as_array().unwrap().iter().map(number).collect();
        let (base, tcp) = (&chain[..3], &chain[chain.len() - 3..]);
        assert_eq!(base, [0.0; 3]);
        let ball = &space["balls_mm"][sample["ball"].as_u64().unwrap() as usize];
        let off: f64 = ball.as_array().unwrap().iter().zip(tcp).map(|(b, t)| (number(b) - t).powi(2)).sum::<f64>().sqrt();
        // Both are whole millimetres.
        assert!(off < 3.0, "{sample}: {off} mm");
    }
    for view in ["side", "top"] {
        let cells = space["maps"][view].as_array().unwrap();
        assert_eq!(cells.iter().map(|c| c[5].as_u64().unwrap()).sum::<u64>(), samples.len() as u64);
        let mean = cells.iter().map(|c| number(&c[4]) * number(&c[5])).sum::<f64>() / samples.len() as f64;
        let lengths = samples.iter().map(|s| number(&s["length_um"])).sum::<f64>() / samples.len() as f64;
        near(1000.0 * mean, lengths, 0.1);
    }
}
