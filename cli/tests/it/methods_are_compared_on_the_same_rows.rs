//! `bench` gives every method the same rows and judges it on the same rows: a method that says what the default model says has its
//! error, one that fails is named and the others go on, and the same seed gives the same bytes.
#![cfg(unix)]

use std::fs;
use std::path::Path;

use crate::program::{calibench, done, json, run_of};
use serde_json::Value;
use tempfile::TempDir;

/// Two campaigns of one robot, each predicted by the robot of the other.
const PLAN: &str =
    "format = \"calibench-bench-plan/1\"\n[[robot]]\nname = \"kr6\"\ndata = [\"tracker\", \"trical\"]\ncampaigns = true\n";

/// The columns of the default model under the titles of a prediction.
const ECHO: &str = r#"awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; print "x_mm,y_mm,z_mm,expected_mm"; next }
{ print $at["default_x_mm"] "," $at["default_y_mm"] "," $at["default_z_mm"] ",0.1" }' "$1/judged.csv" > "$1/predicted.csv""#;

/// Rounding of the positions in the files, mm.
const NANOMETRE: f64 = 1e-6;

/// A folder with the run of a scenario, the plan and these scripts.
fn prepared(scripts: &[(&str, &str)]) -> TempDir {
    let folder = run_of("table8.toml");
    fs::write(folder.path().join("robots.toml"), PLAN).unwrap();
    for (name, text) in scripts {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// The entries of a method.
fn of<'a>(document: &'a Value, method: &'a str) -> Vec<&'a Value> {
    let entries: Vec<&Value> = document["divisions"].as_array().unwrap().iter().filter(|e| e["method"] == method).collect();
    assert_eq!(entries.len(), 2, "{method}: {document:#}");
    entries
}

fn document(folder: &Path, output: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join(output).join("leaderboard.json")).unwrap()).unwrap()
}

#[test]
fn a_method_is_judged_as_the_proof_judges_and_the_same_seed_gives_the_same_bytes() {
    let folder = prepared(&[("echo.sh", ECHO)]);
    let folder = folder.path();
    for output in ["first", "second"] {
        done(folder, &["bench", "robots.toml", "--data", "run", "--rival", "echo=sh echo.sh", "-o", output]);
    }
    for file in
        ["leaderboard.csv", "divisions/tracker-robot-of-trical/fitted.csv", "divisions/tracker-robot-of-trical/judged.csv"]
    {
        let [first, second] = ["first", "second"].map(|output| fs::read(folder.join(output).join(file)).unwrap());
        assert!(first == second, "{file} differs between two runs of one seed");
    }
    // What is there need not be predicted again.
    done(folder, &["bench", "robots.toml", "--data", "run", "--rival", "echo=sh gone.sh", "--resume", "-o", "second"]);
    let [first, resumed] = ["first", "second"].map(|output| fs::read(folder.join(output).join("leaderboard.csv")).unwrap());
    assert!(first == resumed, "a resumed run differs");
    let document = document(folder, "first");
    let proofs = json(folder, &["effects", "prove", "run/tracker", "run/trical", "--folds", "0", "--campaigns", "--json"]);
    let proofs = proofs["proofs"].as_array().unwrap();
    let [default, recommended, echo] = ["default", "recommended", "echo"].map(|method| of(&document, method));
    for (k, proof) in proofs.iter().enumerate() {
        for (entry, key) in [(default[k], "default_mm"), (recommended[k], "recommended_mm")] {
            let (here, there) = (entry["judged"]["rms_mm"].as_f64().unwrap(), proof[key].as_f64().unwrap());
            assert!((here - there).abs() < NANOMETRE, "{key}: {here} and {there} of the proof");
        }
        let mean = |entry: &Value| entry["judged"]["mean_mm"].as_f64().unwrap();
        assert!((mean(echo[k]) - mean(default[k])).abs() < NANOMETRE, "{:#} {:#}", echo[k], default[k]);
        let expected = echo[k]["judged"]["expected_over_measured"].as_f64().unwrap();
        assert!((expected * mean(echo[k]) - 0.1).abs() < NANOMETRE, "{expected}");
        let interval = &echo[k]["judged"]["interval_mm"];
        assert!(interval[0].as_f64().unwrap() < mean(echo[k]) && mean(echo[k]) < interval[1].as_f64().unwrap(), "{interval}");
    }
    let fitted = fs::read_to_string(folder.join("first/divisions/tracker-robot-of-trical/fitted.csv")).unwrap();
    assert_eq!(fitted.lines().filter(|line| line.contains(",set_up,tracker/")).count(), 50, "fifty poses tell base and tool");
    let judged = fs::read_to_string(folder.join("first/divisions/tracker-robot-of-trical/judged.csv")).unwrap();
    let title = judged.lines().next().unwrap();
    assert!(title.contains("default_x_mm") && !title.contains("measured") && !title.contains("residual"), "{title}");
}

#[test]
fn a_method_that_fails_is_named_and_the_others_go_on() {
    let folder = prepared(&[
        ("echo.sh", ECHO),
        ("fails.sh", "echo no licence for this robot >&2; exit 7"),
        ("short.sh", "printf 'x_mm,y_mm,z_mm\\n1,2,3\\n' > \"$1/predicted.csv\""),
        ("silent.sh", "true"),
        ("hangs.sh", "exec sleep 60"),
        ("nan.sh", &format!("{ECHO}\nsed -i '3s/^[^,]*/nan/' \"$1/predicted.csv\"")),
    ]);
    let folder = folder.path();
    let mut arguments = vec!["bench", "robots.toml", "--data", "run", "-o", "out", "--limit", "5", "--json"];
    let rivals = ["fails", "short", "silent", "hangs", "nan", "echo"].map(|name| format!("sh {name}.sh"));
    rivals.iter().for_each(|rival| arguments.extend(["--rival", rival]));
    let output = calibench(folder, &arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    let document = document(folder, "out");
    for (method, words) in [
        ("fails", &["exit status: 7", "fails.log"][..]),
        ("short", &["predicted.csv has 1 rows and judged.csv 30"]),
        ("silent", &["predicted.csv", "write one row of x_mm, y_mm, z_mm"]),
        ("hangs", &["had not ended after 5 s"]),
        ("nan", &["predicted.csv:3: x_mm: 'nan' is not a finite number"]),
    ] {
        let entries = of(&document, method);
        let fault = entries[0]["fault"].as_str().unwrap();
        assert!(words.iter().all(|word| fault.contains(word)), "{fault}");
        assert_eq!((&entries[0]["judged"], entries[0]["ratio"].as_f64()), (&Value::Null, Some(1.0)), "the default model stays");
        let told = said.lines().find(|line| line.contains(&format!("{method}, tracker-robot-of-trical: "))).unwrap_or_default();
        assert!(words.iter().all(|word| told.contains(word)), "{method}: {said}");
    }
    assert!(of(&document, "echo").iter().all(|entry| entry["judged"].is_object()), "{document:#}");
    let log = fs::read_to_string(folder.join("out/divisions/tracker-robot-of-trical/fails.log")).unwrap();
    assert!(log.contains("no licence"), "{log}");
    let ratios: Vec<f64> = document["standings"].as_array().unwrap().iter().map(|s| s["ratio"].as_f64().unwrap()).collect();
    assert!(ratios.len() == 8 && ratios.is_sorted_by(|worse, better| worse >= better), "the worst comes first: {ratios:?}");
}

#[test]
fn wrong_flags_end_before_the_work() {
    let folder = prepared(&[
        ("other.toml", "format = \"calibench-bench-plan/9\"\n"),
        ("typo.toml", "format = \"calibench-bench-plan/1\"\nrobots = 1\n"),
    ]);
    for (arguments, words) in [
        (&["bench", "nothing.toml"][..], "nothing.toml"),
        (&["bench", "other.toml"], "calibench-bench-plan/1"),
        (&["bench", "typo.toml"], "robots"),
        (&["bench", "robots.toml", "--only", "ur99"], "--only ur99: is not a robot of robots.toml"),
        (&["bench", "robots.toml", "--rival", ""], "there is no command"),
        (&["bench", "robots.toml", "--rival", "default=sh a.sh"], "--rival default: there is a method of this name already"),
        (
            &["bench", "robots.toml", "--rival", "sh a.sh", "--rival", "sh b/a.sh"],
            "--rival a: there is a method of this name already",
        ),
        (
            &["bench", "robots.toml", "--data", "run", "--rival", "no-such-program here.py"],
            "'no-such-program' cannot be started",
        ),
        (&["bench", "robots.toml", "--data", "nowhere"], "nowhere"),
    ] {
        let output = calibench(folder.path(), &[arguments, &["-o", "out"]].concat());
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && said.contains(words), "{arguments:?}: {said}");
    }
}
