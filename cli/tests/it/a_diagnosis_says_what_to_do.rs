//! `diagnose` in words: observation, meaning and action; the commands it names run, and the document has the promised keys.

use std::fs;
use std::path::Path;

use crate::program::{calibench, json, run_of};
use serde_json::Value;

fn diagnosed(folder: &Path, arguments: &[&str]) -> Value {
    json(folder, &[&["diagnose", "--json"], arguments].concat())
}

fn sentences(v: &Value) -> Vec<String> {
    v["sentences"].as_array().unwrap().iter().map(|s| s.as_str().unwrap().to_owned()).collect()
}

/// The first command in a sentence beginning with this label, without the program's name.
fn command(label: &str, said: &[String]) -> Vec<String> {
    let quoted = said.iter().filter(|s| s.starts_with(label)).find_map(|s| s.split('`').nth(1)).unwrap();
    quoted.strip_prefix("calibench ").unwrap().split(' ').map(str::to_owned).collect()
}

#[test]
fn from_few_samples_and_noise_stated_too_large_little_is_concluded() {
    let folder = run_of("table8.toml");
    let trical = folder.path().join("run/trical");
    let samples = fs::read_to_string(trical.join("samples.csv")).unwrap();
    let described = fs::read_to_string(trical.join("dataset.toml")).unwrap();
    let noise = described.lines().find(|line| line.starts_with("ball_um = ")).unwrap();
    let stated: f64 = noise.trim_start_matches("ball_um = ").parse().unwrap();
    let with = |name: &str, factor: f64, rows: usize| {
        let at = folder.path().join(name);
        fs::create_dir(&at).unwrap();
        let few: Vec<&str> = samples.lines().take(1 + rows).collect();
        fs::write(at.join("samples.csv"), few.join("\n") + "\n").unwrap();
        fs::write(at.join("dataset.toml"), described.replace(noise, &format!("ball_um = {}", factor * stated))).unwrap();
        if trical.join("robot.toml").exists() {
            fs::copy(trical.join("robot.toml"), at.join("robot.toml")).unwrap();
        }
        let v = diagnosed(folder.path(), &[name]);
        let next = v["advice"]["sentences"][0].as_str().unwrap().to_owned();
        (v["verdict"].as_str().unwrap().to_owned(), sentences(&v).join("\n"), next)
    };
    let (verdict, said, next) = with("few", 1.0, 14);
    assert_eq!(verdict, "nothing_left");
    assert!(
        said.contains("hardly anything could be found: 42 residuals") && next.contains("measure more postures"),
        "{said}\n{next}"
    );
    let (verdict, said, next) = with("all", 1.0, 80);
    assert_eq!(verdict, "nothing_left");
    assert!(
        !said.contains("hardly anything") && !said.contains("too large") && next.contains("nothing is to be added"),
        "{said}"
    );
    let (_, said, _) = with("loud", 3.0, 80);
    assert!(said.contains("it is stated too large"), "{said}");
}

#[test]
fn a_moved_ball_is_named_and_to_be_looked_at() {
    let folder = run_of("moved-ball.toml");
    let v = diagnosed(folder.path(), &["run/trical"]);
    for key in [
        "format",
        "samples",
        "dof",
        "residual_mm",
        "noise_left_mm",
        "unexplained_mm",
        "chi2_per_dof",
        "lack_of_fit_p",
        "verdict",
        "set95",
        "findings",
        "heat_map",
        "untestable",
        "fitted",
        "workspace",
        "outside_range",
        "sentences",
    ] {
        assert!(v.get(key).is_some(), "{key}");
    }
    assert_eq!((&v["format"], &v["verdict"]), (&"calibench-diagnosis/2".into(), &"identified".into()));
    assert_eq!(v["findings"][0]["effect"], "ball:3");
    let said = sentences(&v);
    let saw = said.iter().find(|s| s.starts_with("Saw: ") && s.contains("(ball:3)")).unwrap();
    assert!(saw.contains("mm") && saw.contains("explains") && saw.contains("the fitted model hides"), "{saw}");
    assert!(said.iter().any(|s| s.starts_with("Do: look at that ball")), "{said:?}");
    let next: Vec<String> = v["advice"]["sentences"].as_array().unwrap().iter().map(|s| s.as_str().unwrap().into()).collect();
    let arguments = command("Next:", &next);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    assert_eq!(arguments, ["add", "ball:3", "run/trical"]);
    assert_eq!(v["advice"]["command"], "calibench add ball:3 run/trical");
    let step = calibench(folder.path(), &arguments);
    assert!(step.status.success(), "{}", String::from_utf8_lossy(&step.stderr));
    // A map of the workspace with a number in every ring that contains a pose.
    let w = &v["workspace"];
    assert_eq!(w["from"], "drawn");
    let cells: Vec<&Value> = w["map"]["cells"].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap()).collect();
    let poses: u64 = cells.iter().filter(|c| !c.is_null()).map(|c| c["poses"].as_u64().unwrap()).sum();
    assert_eq!((cells.len(), poses), (25, w["poses"].as_u64().unwrap()));
}

#[test]
fn what_no_catalogue_holds_is_shown_as_a_curve_to_add() {
    let folder = run_of("blind-gear-defect.toml");
    let v = diagnosed(folder.path(), &["run/trical"]);
    assert_eq!(v["verdict"], "unexplained");
    let said = sentences(&v);
    assert!(said.iter().any(|s| s.starts_with("Saw: the error of joint 3 follows the angle of joint 3 (q3)")), "{said:?}");
    assert!(said.iter().any(|s| s.contains("µrad, one-sigma")), "{said:?}");
    let command = v["advice"]["command"].as_str().unwrap();
    let arguments: Vec<&str> = command.split(' ').skip(1).chain(["--json"]).collect();
    assert_eq!(arguments[..2], ["add", "curve:3:q3"]);
    let step = calibench(folder.path(), &arguments);
    assert!(step.status.success(), "{}", String::from_utf8_lossy(&step.stderr));
    let step: Value = serde_json::from_slice(&step.stdout).unwrap();
    let rms = |side: &str| step[side]["cross_validated_mm"].as_f64().unwrap();
    assert!(rms("after") < 0.7 * rms("before"), "{} to {}", rms("before"), rms("after"));
    let text = calibench(folder.path(), &["diagnose", "run/trical"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("JOINT ERROR BY VARIABLE") && text.contains(" *"), "{text}");
}

#[test]
fn chi_square_is_not_spoken_of_where_no_noise_is_stated() {
    let folder = run_of("payload-wrong.toml");
    let path = folder.path().join("run/trical/dataset.toml");
    let text = fs::read_to_string(&path).unwrap();
    let (before, after) = text.split_once("[noise]").unwrap();
    let rest = after.split_once("\n[").map_or(String::new(), |(_, rest)| format!("[{rest}"));
    fs::write(&path, format!("{before}{rest}")).unwrap();
    let v = diagnosed(folder.path(), &["run/trical"]);
    assert_eq!((&v["chi2_per_dof"], &v["lack_of_fit_p"]), (&Value::Null, &Value::Null));
    let said = sentences(&v);
    assert!(said.iter().all(|s| !s.contains("chi2")), "{said:?}");
    assert_eq!(v["set95"], serde_json::json!(["payload_com"]));
}
