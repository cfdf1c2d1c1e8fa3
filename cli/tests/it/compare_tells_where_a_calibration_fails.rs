//! `compare` on the program's own measurements: the paper's robot shows joint errors, a correct model shows nothing, JSON and
//! plot files agree, and bad input ends in one line with a remedy.

use calibench::measure::dataset::NamedDataset;
use std::fs;
use std::path::Path;

use crate::program::{calibench, done, json, run_of, scenario};
use calibench::diagnosis::diagnose;
use calibench::identify::Model;
use calibench::identify::fit::Outcome;
use calibench::measure::dataset::file::read_dataset;
use calibench_report::sentences;
use serde_json::Value;

fn compared(folder: &Path, arguments: &[&str]) -> Value {
    json(folder, &[&["compare", "--json"], arguments].concat())
}

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key}: {v}"))
}

#[test]
fn the_papers_robot_shows_its_first_joint() {
    let folder = run_of("paper.toml");
    let v = compared(folder.path(), &["run/trical.toml", "run/trical", "--plots", "plots"]);
    assert_eq!(
        (&v["format"], &v["samples"], &v["noise_source"]),
        (&"calibench-comparison/2".into(), &80.into(), &"stated".into())
    );
    assert_eq!(v["fitted"], true);
    let calibration = fs::read_to_string(folder.path().join("run/result.json")).unwrap();
    let calibration: Value = serde_json::from_str(&calibration).unwrap();
    for key in ["residual_mm", "chi2_per_dof"] {
        let identified = number(&calibration["methods"][0]["calibration"], key);
        assert!((number(&v, key) / identified - 1.0).abs() < 1e-3, "{key}: {} and {identified}", v[key]);
    }
    assert!(number(&v, "unexplained_mm") > 5.0 * number(&v, "noise_mm") && number(&v, "lack_of_fit_p") < 1e-12);
    // The largest error added by the scenario has one period per revolution of joint 1.
    assert_eq!(
        (&v["findings"][0]["view"], &v["findings"][0]["joint"], &v["findings"][0]["against"]),
        (&"joint".into(), &1.into(), &"q1".into())
    );
    assert_eq!((&v["joints"][0]["joint"], &v["joints"][0]["against"]), (&1.into(), &"q1".into()));
    let bins = v["joints"][0]["bins"].as_array().unwrap();
    assert_eq!(bins.iter().map(|b| b["n"].as_u64().unwrap()).sum::<u64>(), 80);
    assert!(bins.iter().all(|b| ["x", "mean_urad", "sigma_urad"].iter().all(|key| number(b, key).is_finite())));
    assert_eq!((v["balls"].as_array().unwrap().len(), v["worst"].as_array().unwrap().len()), (4, 5));
    // The decisive figure: the error where the calibration was not fitted, predicted from the fitted rows alone.
    let judged = done(folder.path(), &["validate", "run/trical.toml", "run/validation", "--json"]);
    let judged: Value = serde_json::from_str(&judged).unwrap();
    let expected = number(&v["workspace"], "mean_mm") / number(&judged, "mean_mm");
    assert!((0.75..1.33).contains(&expected), "{expected}");
    assert!(number(&judged["outside_range"], "samples") > 0.0 && v["outside_range"].is_null(), "{}", judged["outside_range"]);
    let map = fs::read_to_string(folder.path().join("plots/workspace.csv")).unwrap();
    assert!(map.starts_with("radius_from_mm,") && map.lines().count() > 10, "{map}");
    for sentence in v["sentences"].as_array().unwrap() {
        assert!(sentence.as_str().unwrap().ends_with('.'), "{sentence}");
    }

    // One row per bin, with the numbers of the document.
    let joints = fs::read_to_string(folder.path().join("plots/joints.csv")).unwrap();
    let first: Vec<&str> = joints.lines().nth(1).unwrap().split(',').collect();
    assert_eq!(first[..3], ["1", "q1", "deg"]);
    assert!((first[6].parse::<f64>().unwrap() - number(&bins[0], "mean_urad")).abs() < 1e-9);
    assert_eq!(fs::read_to_string(folder.path().join("plots/residuals.csv")).unwrap().lines().count(), 81);

    // At unfitted poses the same calibration is worse than its residuals suggest.
    let new = compared(folder.path(), &["run/trical.toml", "run/validation", "--validation"]);
    assert_eq!((&new["fitted"], &new["samples"]), (&false.into(), &500.into()));
    assert!(new["workspace"].is_null() && number(&new["outside_range"]["joints"][0], "farthest_deg") > 0.0);
    assert!(number(&new, "unexplained_mm") > 2.0 * number(&v, "unexplained_mm"));
    let said = done(folder.path(), &["compare", "run/trical.toml", "run/trical"]);
    for heading in [
        "BY BALL (artifact)",
        "IN THE TOOL'S AXES (gauge)",
        "IN THE WORLD (base)",
        "PROJECTED TO THE JOINTS (arm)",
        "WORST SAMPLES",
        "OVER THE WORKSPACE",
    ] {
        assert!(said.contains(heading), "{heading}: {said}");
    }
}

#[test]
fn a_right_model_leaves_nothing_to_say() {
    let folder = run_of("table8.toml");
    let v = compared(folder.path(), &["run/trical.toml", "run/trical"]);
    assert_eq!(v["findings"].as_array().map(Vec::len), Some(0), "{v}");
    assert!(number(&v, "lack_of_fit_p") > 0.01);
}

#[test]
fn bad_input_is_one_line_with_a_remedy() {
    let folder = run_of("perfect.toml");
    let at = folder.path();
    fs::create_dir(at.join("mine")).unwrap();
    fs::write(at.join("mine/notes.txt"), "mine").unwrap();
    let samples = fs::read_to_string(at.join("run/trical/samples.csv")).unwrap();
    fs::create_dir(at.join("bad")).unwrap();
    fs::copy(at.join("run/trical/dataset.toml"), at.join("bad/dataset.toml")).unwrap();
    fs::write(at.join("bad/samples.csv"), samples.replacen("p01,ball,", "p01,bell,", 1)).unwrap();
    let cases: [(&[&str], &[&str]); 5] = [
        (&["run/trical.toml", "bad"], &["bad/samples.csv:2", "kind", "ball"]),
        (&["run/nosuch.toml", "run/trical"], &["run/nosuch.toml", "check the path"]),
        (&["run/trical.toml", "run/trical", "--validation"], &["run/trical/samples.csv", "set", "'validation'"]),
        (&["run/trical.toml", "run/trical", "--validation", "--all"], &["--all", "calibench --help"]),
        (&["run/trical.toml", "run/trical", "--plots", "mine"], &["mine", "not a comparison", "name a new folder"]),
    ];
    for (arguments, expected) in cases {
        let output = calibench(at, &[&["compare"], arguments].concat());
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{arguments:?}: {error}");
        assert_eq!(error.matches('\n').count(), 1, "{error}");
        for part in expected {
            assert!(error.contains(part), "{part:?} in {error}");
        }
    }
    assert_eq!(fs::read_dir(at.join("mine")).unwrap().count(), 1);
}

/// Writes the rows of these balls alone as a dataset of their own.
fn of_balls(folder: &Path, balls: &[&str], name: &str) {
    let samples = fs::read_to_string(folder.join("run/trical/samples.csv")).unwrap();
    let (header, rows) = samples.split_once('\n').unwrap();
    let column = header.split(',').position(|c| c == "ball").unwrap();
    let kept = rows.lines().filter(|row| row.split(',').nth(column).is_some_and(|ball| balls.contains(&ball)));
    let text: Vec<&str> = std::iter::once(header).chain(kept).collect();
    fs::create_dir(folder.join(name)).unwrap();
    fs::write(folder.join(name).join("samples.csv"), text.join("\n") + "\n").unwrap();
    fs::copy(folder.join("run/trical/dataset.toml"), folder.join(name).join("dataset.toml")).unwrap();
}

/// With one ball the robot may be rotated arbitrarily about it, with two about the line through them: its position in the world
/// is then undetermined, and an error of hundredths of a millimetre must not be claimed.
#[test]
fn the_error_to_expect_is_told_only_where_the_base_is_known() {
    let folder = run_of("table8.toml");
    let at = folder.path();
    for (balls, open) in [(&["1"][..], 3), (&["3", "4"], 1), (&["1", "2", "3", "4"], 0)] {
        let name = balls.join("and");
        of_balls(at, balls, &name);
        let expected = |json: &Value| (json["workspace"].is_null(), json["undetermined"].as_array().map(Vec::len));
        done(at, &["identify", &name, "-o", "c.toml"]);
        assert_eq!(compared(at, &["c.toml", &name])["workspace"].is_null(), open > 0, "{name}");
        let diagnosed = done(at, &["diagnose", &name]);
        assert_eq!(diagnosed.contains("cannot be predicted: base_r"), open > 0, "{name}: {diagnosed}");
        let ladder: Value = serde_json::from_str(&done(at, &["ladder", "--json", &name])).unwrap();
        assert_eq!(expected(&ladder["rungs"][0]), (open > 0, Some(open)), "{name}");
    }
}

/// A mean lies within its own band, and two verbs report the same noise.
#[test]
fn a_knocked_ball_is_told_alike_by_all() {
    let scenario = scenario("moved-ball.toml");
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for seed in ["1", "2", "3"] {
        done(at, &["run", &scenario, "--out", seed, "--seed", seed]);
        let data = format!("{seed}/trical");
        let diagnosis: Value = serde_json::from_str(&done(at, &["diagnose", "--json", &data])).unwrap();
        let comparison = compared(at, &[&format!("{seed}/trical.toml"), &data]);
        let (one, other) = (number(&diagnosis, "noise_left_mm"), number(&comparison, "noise_left_mm"));
        assert!((one / other - 1.0).abs() < 1e-3, "seed {seed}: {one} and {other}");
        let ladder: Value = serde_json::from_str(&done(at, &["ladder", "--json", &data])).unwrap();
        for ladder_step in ladder["rungs"].as_array().unwrap() {
            let band = ladder_step["workspace"]["mean_band_mm"].as_array().unwrap();
            let (mean, low, high) =
                (number(&ladder_step["workspace"], "mean_mm"), band[0].as_f64().unwrap(), band[1].as_f64().unwrap());
            assert!((low..=high).contains(&mean), "seed {seed}: {mean} in {low} to {high}");
        }
    }
}

/// The results of a fit that did not converge are invalid: every verb that reads it says so, and none commands a robot with it.
#[test]
fn a_fit_that_did_not_converge_is_used_for_nothing() {
    let folder = run_of("table8.toml");
    let at = folder.path();
    let file = fs::read_to_string(at.join("run/trical.toml")).unwrap();
    fs::write(at.join("c.toml"), file.replace("outcome = \"converged\"", "outcome = \"iteration_limit\"")).unwrap();
    for verb in ["compare", "validate"] {
        let warned = String::from_utf8(calibench(at, &[verb, "c.toml", "run/trical"]).stderr).unwrap();
        assert!(warned.contains("do not use this calibration"), "{verb}: {warned}");
    }
    fs::write(at.join("targets.csv"), "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\np1,420,60,400,170,10,175\n").unwrap();
    let refused = calibench(at, &["compensate", "c.toml", "targets.csv", "-o", "fakes.csv"]);
    assert_eq!(refused.status.code(), Some(2), "{}", String::from_utf8_lossy(&refused.stderr));
    assert!(!at.join("fakes.csv").exists());

    let data = read_dataset(&at.join("run/trical")).unwrap();
    let mut diagnosis = diagnose(&[NamedDataset::new("d", &data)], &Model::default_for(&data)).unwrap();
    diagnosis.outcome = Outcome::IterationLimit;
    let said = sentences(&diagnosis);
    assert!(said[0].is_answer && said[0].text.starts_with("WARNING: the fit used up its steps"), "{said:?}");
    assert!(said.iter().all(|sentence| !sentence.text.contains("Verdict")), "{said:?}");
}

#[test]
fn several_calibrations_are_judged_on_rows_that_no_fit_has_seen() {
    let folder = run_of("paper.toml");
    let at = folder.path();
    fs::write(at.join("base.toml"), r#"effects = ["base_frame"]"#).unwrap();

    // On rows that it has not seen a calibration errs as `validate` says.
    let all = compared(at, &["run/trical.toml", "base.toml", "run/trical", "run/validation"]);
    let validated = json(at, &["validate", "run/trical.toml", "run/validation", "--json"]);
    assert_eq!((&all["format"], &all["judged_on"]), (&"calibench-side-by-side/1".into(), &"held_out".into()));
    let [first, second] = [&all["calibrations"][0], &all["calibrations"][1]];
    assert!((number(first, "mean_mm") - number(&validated, "mean_mm")).abs() < 1e-9);
    assert_eq!(second["difference"]["better"], "run/trical.toml");
    assert!(number(&second["difference"], "mean_mm") > number(&second["difference"], "two_errors_mm"));
    assert!(first["apart"].as_array().unwrap().is_empty() && first["difference"].is_null());

    // Two calibrations stand as far apart as the smaller one knows nothing of: about the error of the larger.
    let apart = &second["apart"].as_array().unwrap()[0];
    assert_eq!(apart["from"], "ranges");
    assert!((0.3..3.0).contains(&(number(apart, "mean_mm") / number(second, "mean_mm"))), "{apart}");

    // A calibration beside itself is nowhere apart, and none is preferred.
    let same = compared(at, &["run/trical.toml", "run/trical.toml", "run/trical", "run/validation"]);
    let second = &same["calibrations"][1];
    assert!(second["difference"]["better"].is_null() && number(&second["difference"], "mean_mm") == 0.0);
    assert!(second["apart"].as_array().unwrap().iter().all(|a| number(a, "max_mm") == 0.0));

    // What a terminal shows are the same figures.
    let said = done(at, &[&["compare"][..], &["run/trical.toml", "base.toml", "run/trical", "run/validation"]].concat());
    assert!(
        said.contains(&format!("{:.3}", number(first, "mean_mm")))
            && said.contains("Better on rows not fitted: run/trical.toml.")
    );

    for (arguments, remedy) in [
        (&["compare", "run/trical.toml", "base.toml"][..], "name a dataset folder"),
        (&["compare", "run/trical.toml", "base.toml", "run/trical", "--all"], "are for one calibration"),
        (&["compare", "run/trical.toml", "base.toml", "run/no-such"], "run/no-such"),
    ] {
        let refused = calibench(at, arguments);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{said}");
        assert!(said.contains(remedy), "{said}");
    }
}
