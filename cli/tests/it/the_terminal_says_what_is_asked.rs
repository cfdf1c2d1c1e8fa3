//! Colour, the levels of `-q` and `-v`, and `-` for the standard streams: each changes what it is for, and nothing else.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::program::run_of;
use serde_json::Value;

fn calibench(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).args(arguments).env_remove("COLUMNS").env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
    command.output().unwrap()
}

fn with(folder: &Path, variable: &str, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).args(arguments).env_remove("COLUMNS").env_remove("NO_COLOR").env(variable, "1");
    String::from_utf8(command.output().unwrap().stdout).unwrap()
}

fn fed(folder: &Path, input: &[u8], arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(input).unwrap();
    child.wait_with_output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The text without the codes of its colours.
fn plain(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |all, part| all + part.split_once('m').map_or("", |(_, rest)| rest))
}

#[test]
fn colour_is_for_terminals_and_for_those_who_ask() {
    let folder = run_of("gear-ripple.toml");
    let at = folder.path();
    let diagnose = ["diagnose", "run/trical"];
    let piped = text(&calibench(at, &diagnose).stdout);
    assert!(!piped.contains('\u{1b}') && !piped.contains('\u{2060}'), "{piped}");
    let always = text(&calibench(at, &[&diagnose[..], &["--color", "always"]].concat()).stdout);
    assert!(always.contains('\u{1b}'));
    assert_eq!(plain(&always), piped);
    assert_eq!(with(at, "CLICOLOR_FORCE", &diagnose), always);
    assert_eq!(with(at, "CLICOLOR_FORCE", &[&diagnose[..], &["--color", "never"]].concat()), piped);
    // A request outweighs a wish of the environment.
    assert_eq!(with(at, "NO_COLOR", &[&diagnose[..], &["--color", "always"]].concat()), always);
    let json = with(at, "CLICOLOR_FORCE", &[&diagnose[..], &["--json", "--color", "always"]].concat());
    assert!(!json.contains('\u{1b}') && serde_json::from_str::<Value>(&json).is_ok(), "{json}");
}

#[test]
fn levels_take_lines_away_and_change_none() {
    let folder = run_of("gear-ripple.toml");
    let at = folder.path();
    for arguments in [
        &["identify", "run/trical"][..],
        &["validate", "run/trical.toml", "run/validation"],
        &["compare", "run/trical.toml", "run/trical"],
        &["diagnose", "run/trical"],
        &["add", "harmonic:3:202", "run/trical"],
        &["ladder", "run/trical"],
        &["effects", "prove", "run/trical", "--effect", "joint_scale", "--nothing", "0"],
    ] {
        let told = calibench(at, arguments);
        let whole = text(&told.stdout);
        for level in ["-q", "-qq"] {
            let quiet = calibench(at, &[arguments, &[level]].concat());
            assert_eq!(quiet.status.code(), told.status.code(), "{arguments:?}");
            let answer = text(&quiet.stdout);
            assert!(!answer.trim().is_empty() && answer.lines().count() < whole.lines().count(), "{arguments:?}:\n{answer}");
            let mut lines = whole.lines();
            assert!(answer.lines().all(|line| lines.any(|l| l == line)), "{arguments:?}:\n{answer}");
            let beside = text(&quiet.stderr);
            assert!(beside.lines().all(|line| level == "-q" && line.to_lowercase().starts_with("warning")), "{beside}");
        }
        let detailed = calibench(at, &[arguments, &["-v"]].concat());
        assert_eq!(text(&detailed.stdout), whole, "{arguments:?}");
        let beside = text(&detailed.stderr);
        assert!(beside.contains(" s in all"), "{beside}");
        assert!(
            arguments[0] == "validate" || arguments[0] == "compare" || beside.lines().any(|line| line.ends_with(" s")),
            "{arguments:?}: {beside}"
        );
    }
    // A reason for which a verb fails is told at every level.
    let refused = calibench(at, &["diagnose", "nowhere", "-qq"]);
    assert!(refused.status.code() == Some(2) && text(&refused.stderr).starts_with("calibench: nowhere"));
}

#[test]
fn a_dash_is_a_standard_stream_with_the_bytes_of_the_file() {
    let folder = run_of("gear-ripple.toml");
    let at = folder.path();
    let done = |arguments: &[&str]| {
        let output = calibench(at, arguments);
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
        output
    };
    fs::write(at.join("targets.csv"), "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\np1,420,60,400,170,10,175\n").unwrap();
    done(&["identify", "run/trical", "-o", "c.toml"]);
    done(&["add", "harmonic:3:202", "run/trical", "-o", "m.toml"]);
    done(&["compensate", "c.toml", "targets.csv", "-o", "fake.csv"]);
    done(&["report", "run/trical", "-o", "page.html"]);
    for (file, arguments) in [
        ("c.toml", &["identify", "run/trical", "-o", "-"][..]),
        ("m.toml", &["add", "harmonic:3:202", "run/trical", "-o", "-"]),
        ("fake.csv", &["compensate", "c.toml", "targets.csv", "-o", "-"]),
        ("page.html", &["report", "run/trical", "-o", "-"]),
    ] {
        let output = done(arguments);
        assert!(output.stdout == fs::read(at.join(file)).unwrap(), "{arguments:?}");
        assert!(!output.stderr.is_empty(), "{arguments:?}: what is told goes to standard error");
    }
    for (file, named, dashed) in [
        ("m.toml", &["identify", "run/trical", "--model", "m.toml"][..], &["identify", "run/trical", "--model", "-"][..]),
        ("c.toml", &["validate", "c.toml", "run/validation"], &["validate", "-", "run/validation"]),
        ("targets.csv", &["compensate", "c.toml", "targets.csv", "-o", "-"], &["compensate", "c.toml", "-", "-o", "-"]),
        ("c.toml", &["compensate", "c.toml", "targets.csv", "-o", "-"], &["compensate", "-", "targets.csv", "-o", "-"]),
        // The layout of the model file is kept, for which it is read once more.
        (
            "m.toml",
            &["ladder", "run/trical", "--model", "m.toml", "-o", "-"],
            &["ladder", "run/trical", "--model", "-", "-o", "-"],
        ),
    ] {
        let output = fed(at, &fs::read(at.join(file)).unwrap(), dashed);
        assert!(output.status.success(), "{dashed:?}: {}", text(&output.stderr));
        assert_eq!(text(&output.stdout), text(&done(named).stdout), "{dashed:?}");
    }
    for (arguments, said) in [
        (&["identify", "-"][..], "datasets: `-`"),
        (&["run", "-"], "scenario: `-`"),
        (&["identify", "run/trical", "-o", "-", "--json"], "both write to standard output"),
        (&["compensate", "-", "-", "-o", "fake.csv"], "can be read once"),
        (&["add", "harmonic:3:202", "run/trical", "--model", "-"], "cannot be updated in place"),
        (&["compare", "c.toml", "run/trical", "--plots", "-"], "plots: `-`"),
    ] {
        let output = fed(at, b"", arguments);
        let error = text(&output.stderr);
        assert!(
            output.status.code() == Some(2) && error.contains(said) && error.lines().count() == 1,
            "{arguments:?}: {error}"
        );
    }
    // An error in what was read names where it came from.
    let wrong = fed(at, b"id,x_mm\np1,1\n", &["compensate", "c.toml", "-", "-o", "other.csv"]);
    assert!(text(&wrong.stderr).starts_with("calibench: <standard input>:1: "), "{}", text(&wrong.stderr));
    assert!(!at.join("other.csv").exists());
}

/// A path of a whole word, such as `nothing_left`, `harmonic:3:202` or `urad`, is not a word for people.
#[test]
fn sentences_name_effects_and_verdicts_in_words() {
    for scenario in ["gear-ripple.toml", "moved-ball.toml", "table8.toml"] {
        let folder = run_of(scenario);
        for verb in ["diagnose", "ladder"] {
            let output = calibench(folder.path(), &[verb, "run/trical"]);
            let said = text(&output.stdout) + &text(&output.stderr);
            for line in said.lines().filter(|line| !line.starts_with(['│', '┌', '└', '╞'])) {
                for raw in ["nothing_left", "suspect_samples", "noise_larger", " urad", " um "] {
                    assert!(!line.contains(raw), "{scenario}, {verb}: {line}");
                }
                // Ids stand in brackets, or in a command.
                let bare = line.split('`').step_by(2).collect::<String>();
                let bare = bare.split('(').map(|part| part.split_once(')').map_or(part, |(_, rest)| rest)).collect::<String>();
                let ids = ["harmonic:", "harmonic1:", "ball:", "joint_scale:"];
                let is_id = |word: &str| ids.iter().any(|id| word.strip_prefix(id).is_some_and(|rest| !rest.is_empty()));
                assert!(!bare.split_whitespace().any(is_id), "{verb}: {line}");
            }
        }
    }
}

/// `diagnose`, the first step of the ladder, `add` and the report all give the same recommendation.
#[test]
fn there_is_one_voice() {
    for scenario in ["gear-ripple.toml", "moved-ball.toml", "table8.toml"] {
        let folder = run_of(scenario);
        let at = folder.path();
        let json = |arguments: &[&str]| -> Value { serde_json::from_slice(&calibench(at, arguments).stdout).unwrap() };
        let diagnosis = json(&["diagnose", "run/trical", "--json"]);
        let ladder = json(&["ladder", "run/trical", "--json"]);
        let report = json(&["report", "run/trical", "--json"]);
        let advice = &diagnosis["advice"];
        let sentences: Vec<&str> = advice["sentences"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
        assert_eq!(report["ladder"]["advice"], sentences.join(" "), "{scenario}");
        let first = ladder["rungs"].get(1).map_or(Value::Array(Vec::new()), |step| step["added"].clone());
        let stopped = &ladder["stopped"]["because"];
        match advice["to_do"].as_str().unwrap() {
            "nothing" => assert_eq!(stopped, "nothing_left", "{scenario}"),
            "add" | "distinguish" => assert_eq!(advice["effects"], first, "{scenario}"),
            _ => assert_eq!(stopped, "no_step_helps", "{scenario}"),
        }
        if advice["to_do"] == "add" {
            let command = advice["command"].as_str().unwrap().strip_prefix("calibench ").unwrap();
            let taken = calibench(at, &command.split(' ').collect::<Vec<_>>());
            assert!(taken.status.success(), "{scenario}: {command}: {}", text(&taken.stderr));
        }
        for refused in advice["refused"].as_array().unwrap() {
            let effect = refused["effect"].as_str().unwrap();
            if effect.contains(" and ") || effect.starts_with("outlier:") {
                continue;
            }
            let step = calibench(at, &["add", effect, "run/trical"]);
            assert_eq!(step.status.code(), Some(1), "{scenario}: `add {effect}` takes what the ladder refuses");
        }
    }
}

#[test]
fn an_import_is_one_document_when_it_succeeds_too() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let made = run_of("table8.toml");
    let samples = fs::read_to_string(made.path().join("run/validation/samples.csv")).unwrap();
    fs::write(at.join("points.csv"), samples).unwrap();
    let guessed = calibench(at, &["import", "guess", "points.csv", "--robot", "kr6_r700", "-o", "map.toml", "--json"]);
    let document: Value = serde_json::from_slice(&guessed.stdout).unwrap();
    assert_eq!(document["format"], "calibench-import-guess/1");
    let imported = calibench(at, &["import", "generic", "points.csv", "--map", "map.toml", "-o", "named", "--json"]);
    assert!(imported.status.success(), "{}", text(&imported.stderr));
    let document: Value = serde_json::from_slice(&imported.stdout).unwrap();
    assert_eq!(document["format"], "calibench-import-report/1");
    assert!(document["samples"].as_u64().unwrap() > 100, "{document}");
    // From standard input, into the same samples.
    let input = fs::read(at.join("points.csv")).unwrap();
    let piped = fed(at, &input, &["import", "generic", "-", "--map", "map.toml", "-o", "piped"]);
    assert!(piped.status.success(), "{}", text(&piped.stderr));
    let samples = |folder: &str| fs::read_to_string(at.join(folder).join("samples.csv")).unwrap();
    // Rows without an id are named by their file.
    assert_eq!(samples("piped").replace("input:", "points:"), samples("named"));
    let map = fs::read(at.join("map.toml")).unwrap();
    let written = calibench(at, &["import", "guess", "points.csv", "--robot", "kr6_r700", "-o", "-"]);
    assert!(written.stdout == map, "{}", text(&written.stderr));
}
