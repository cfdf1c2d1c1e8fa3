//! `add`: a step that helps is written into the model file, preserving comments; one that does not leaves the file unchanged.
//! Scans find their places, curves become user-defined effects, and an effect that cannot be added is refused in one line.

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::program::{calibench, run_of};
use serde_json::Value;

const MODEL: &str = "# our KR6, cell 3\neffects = [\n    \"base_frame\", # it was moved in May\n    \"mdh\",\n    \"joint_compliance\",\n]\n# nothing else is known\n";

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn document(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stdout)))
}

/// A measured robot of the paper, and a model file with comments.
fn paper() -> tempfile::TempDir {
    let folder = run_of("paper.toml");
    fs::write(folder.path().join("model.toml"), MODEL).unwrap();
    folder
}

/// Sets the reading of these samples to 0.6 mm.
fn spoil(path: &Path, ids: &[&str]) {
    let text = fs::read_to_string(path).unwrap();
    let column = text.lines().next().unwrap().split(',').position(|c| c == "r1_um").unwrap();
    let spoilt = text.lines().map(|line| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if ids.contains(&cells[0].as_str()) {
            cells[column] = "600".into();
        }
        cells.join(",") + "\n"
    });
    let spoilt: String = spoilt.collect();
    fs::write(path, spoilt).unwrap();
}

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key}: {v}"))
}

#[test]
fn a_step_that_helps_is_written_and_one_that_does_not_is_not() {
    let folder = paper();
    let at = folder.path();
    let model = || fs::read_to_string(at.join("model.toml")).unwrap();

    let taken = calibench(at, &["add", "harmonic1:1", "run/trical", "--model", "model.toml", "--json"]);
    let step = document(&taken);
    assert_eq!((code(&taken), &step["format"], &step["accepted"]), (0, &"calibench-step/2".into(), &true.into()));
    assert_eq!(step["after"]["added"], serde_json::json!(["harmonic1:1"]));
    for key in ["residual_mm", "cross_validated_mm"] {
        assert!(number(&step["after"], key) < 0.8 * number(&step["before"], key), "{key}: {step}");
    }
    for side in ["before", "after"] {
        let w = &step[side]["workspace"];
        let [low, high] = [0, 1].map(|k| w["mean_band_mm"][k].as_f64().unwrap());
        assert!(low < number(w, "mean_mm") && number(w, "mean_mm") < high, "{w}");
        assert!(number(&step[side], "noise_left_mm") > 0.0 && number(&step[side], "chi2_per_dof") > 1.0);
    }
    // 177 urad of eccentricity and its phase are found, with one-sigma and unit.
    let found = step["after"]["parameters"].as_array().unwrap();
    assert_eq!(found.len(), 2);
    assert!(found.iter().all(|p| p["unit"] == "urad" && number(p, "sigma") > 0.0));
    let expected = MODEL.replace("    \"joint_compliance\",\n", "    \"joint_compliance\",\n    \"harmonic1:1\",\n");
    assert_eq!(model(), expected);

    let refused = calibench(at, &["add", "base_step", "run/trical", "--model", "model.toml", "--json"]);
    let step = document(&refused);
    assert_eq!((code(&refused), &step["accepted"]), (1, &false.into()));
    let reasons = step["objections"].as_array().unwrap();
    assert!(reasons.iter().any(|o| o.as_str().unwrap().contains("that were not fitted are predicted ")), "{step}");
    assert!(String::from_utf8_lossy(&refused.stderr).contains("model.toml is untouched"));
    assert_eq!(model(), expected);
    // The scan found the moment.
    let id = step["after"]["added"][0].as_str().unwrap();
    let moment: f64 = id.strip_prefix("base_step:").unwrap().parse().unwrap();
    assert!(moment > 0.0);

    let forced = calibench(at, &["add", "base_step", "run/trical", "--model", "model.toml", "-o", "other.toml", "--force"]);
    assert_eq!(code(&forced), 0, "{}", String::from_utf8_lossy(&forced.stderr));
    let said = String::from_utf8_lossy(&forced.stdout).into_owned();
    assert!(said.contains("Against it: ") && said.contains("that were not fitted are predicted "), "{said}");
    assert_eq!(model(), expected);
    assert!(fs::read_to_string(at.join("other.toml")).unwrap().contains(&format!("    \"{id}\",\n]")));
}

#[test]
fn a_curve_of_the_heat_map_becomes_an_effect_of_ones_own() {
    let folder = paper();
    let at = folder.path();
    let taken = calibench(at, &["add", "curve:1:q1", "run/trical", "--model", "model.toml", "--json"]);
    let step = document(&taken);
    assert_eq!((code(&taken), &step["after"]["added"][0]), (0, &"curve_1_q1".into()));
    let written = fs::read_to_string(at.join("model.toml")).unwrap();
    assert!(written.starts_with(MODEL), "{written}");
    // The file is an ordinary model: it gives the same fit.
    let again = calibench(at, &["identify", "run/trical", "--model", "model.toml", "--json"]);
    assert_eq!(code(&again), 0, "{}", String::from_utf8_lossy(&again.stderr));
    let (fit, rms) = (number(&step["after"], "residual_mm"), number(&document(&again), "residual_mm"));
    assert!((rms / fit - 1.0).abs() < 1e-6, "{rms} and {fit}");
    let twice = calibench(at, &["add", "curve:1:q1", "run/trical", "--model", "model.toml"]);
    assert_eq!(code(&twice), 2);
}

#[test]
fn a_bad_sample_is_set_aside_by_name() {
    let folder = paper();
    let at = folder.path();
    // A centring that ended 0.3 mm off the ball without its reading showing it.
    spoil(&at.join("run/trical/samples.csv"), &["p14"]);
    let step = calibench(at, &["add", "outlier", "run/trical", "-o", "model2.toml", "--json"]);
    assert_eq!((code(&step), &document(&step)["after"]["added"][0]), (0, &"outlier:p14".into()));
    let said = calibench(at, &["diagnose", "run/trical"]);
    let said = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(said.contains("p14 (") && said.contains("look there before anything else"), "{said}");
}

/// Two samples distort each other's judgement: the advised steps are taken nevertheless, one after the other.
#[test]
fn a_sample_that_the_diagnosis_advises_to_set_aside_is_set_aside() {
    let folder = paper();
    let at = folder.path();
    spoil(&at.join("run/trical/samples.csv"), &["p14", "p41"]);
    let sorted = |effects: &Value| {
        let mut names: Vec<String> = effects.as_array().unwrap().iter().map(|e| e.as_str().unwrap().to_owned()).collect();
        names.sort();
        names
    };
    let both = ["outlier:p14", "outlier:p41"];
    let told = document(&calibench(at, &["diagnose", "run/trical", "--model", "model.toml", "--json"]));
    assert_eq!(sorted(&told["advice"]["effects"]), both);
    // The ladder excludes both at once, as it is said.
    let ladder = document(&calibench(at, &["ladder", "run/trical", "--model", "model.toml", "--json"]));
    assert_eq!(sorted(&ladder["rungs"][1]["added"]), both);
    // The command adds the first; the other is named by the next diagnosis, though what else is missing hides it.
    let command = told["advice"]["command"].as_str().unwrap().to_owned();
    let arguments: Vec<&str> = command.split(' ').skip(1).collect();
    assert!(arguments[..2] == ["add", "outlier:p14"] || arguments[..2] == ["add", "outlier:p41"], "{command}");
    let taken = calibench(at, &arguments);
    assert_eq!(code(&taken), 0, "{arguments:?}: {}", String::from_utf8_lossy(&taken.stderr));
    let told = document(&calibench(at, &["diagnose", "run/trical", "--model", "model.toml", "--json"]));
    let left = if arguments[1] == both[0] { "p41" } else { "p14" };
    let sentences = told["sentences"].as_array().unwrap();
    let looks = |s: &Value| {
        s.as_str().is_some_and(|s| s.contains(&format!("{left} (")) && s.contains("look there before anything else"))
    };
    assert!(sentences.iter().any(looks), "{sentences:?}");
}

#[test]
fn what_cannot_be_added_is_refused_in_one_line() {
    let folder = paper();
    let at = folder.path();
    let cases: [(&[&str], &[&str]); 9] = [
        (&["harmonc1:3", "run/trical"], &["there is no effect 'harmonc1:3'", "did you mean `harmonic1:3`"]),
        (&["hysteresis:9", "run/trical"], &["hysteresis:9", "joint from 1 to 6"]),
        (&["mdh", "run/trical"], &["'mdh' is in the model already"]),
        (&["curve:7:q1", "run/trical"], &["curve:7:q1", "curve:J:VARIABLE", "1 to 6"]),
        (&["curve:2:speed", "run/trical"], &["curve:2:speed", "time_s"]),
        (&["joint_source:2", "run/trical"], &["joint_source:2", "qcmd1_deg"]),
        (&["harmonic1:1", "nosuch"], &["nosuch", "is not there"]),
        (&["harmonic1:1", "run/trical", "--model", "nosuch.toml"], &["nosuch.toml", "check the path"]),
        (&["harmonic1:1", "run/trical", "--check", "nosuch"], &["nosuch", "is not there"]),
    ];
    for (arguments, expected) in cases {
        let output = calibench(at, &[&["add"], arguments].concat());
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((code(&output), output.stdout.len()), (2, 0), "{arguments:?}: {error}");
        assert_eq!(error.matches('\n').count(), 1, "{error}");
        for part in expected {
            assert!(error.contains(part), "{part:?} in {error}");
        }
    }
    assert_eq!(fs::read_to_string(at.join("model.toml")).unwrap(), MODEL);
}

/// A measurement without objections is not excluded: neither the worst of a good campaign nor one named by the user.
#[test]
fn a_good_sample_stays() {
    let folder = run_of("perfect.toml");
    for effect in ["outlier", "outlier:p05", "outlier:p33"] {
        let refused = calibench(folder.path(), &["add", effect, "run/trical", "-o", "model.toml"]);
        assert_eq!(code(&refused), 1, "{effect}: {}", String::from_utf8_lossy(&refused.stdout));
        assert!(!folder.path().join("model.toml").exists());
    }
}
