//! Every number of the workbench equals the one printed by a verb for the same data and model.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::Duration;

use crate::program::run_of;
use crate::workbench::Workbench;
use serde_json::{Value, json};

fn calibench(folder: &Path, arguments: &[&str]) -> Vec<u8> {
    let output = Command::new(env!("CARGO_BIN_EXE_calibench")).current_dir(folder).args(arguments).output().unwrap();
    assert!([Some(0), Some(1)].contains(&output.status.code()), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

fn printed(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_slice(&calibench(folder, arguments)).unwrap()
}

fn ripple() -> tempfile::TempDir {
    run_of("gear-ripple.toml")
}

/// The document without timings.
fn untimed(mut answer: Value) -> Value {
    answer.as_object_mut().unwrap().remove("took_ms");
    answer
}

/// The answer about the model alone, without its history.
fn without_history(answer: Value) -> Value {
    let mut document = answer["document"].clone();
    for key in ["ladder", "meanings"] {
        document.as_object_mut().unwrap().remove(key);
    }
    document
}

/// A diagnosis without the advice, for which the verb asks the ladder; a page has it with its ladder.
fn without_advice(mut diagnosis: Value) -> Value {
    diagnosis.as_object_mut().unwrap().remove("advice");
    diagnosis
}

#[test]
fn steps_and_diagnoses_are_those_of_the_verbs() {
    let folder = ripple();
    let at = folder.path().join("run");
    let bench = Workbench::start(&at, &["trical", "--save-to", "kept"]);

    let begun = untimed(bench.get("document"));
    assert_eq!(begun["document"]["diagnosis"], without_advice(printed(&at, &["diagnose", "trical", "--json"])));
    let report = printed(&at, &["report", "trical", "--json"]);
    for key in ["verdict", "figures", "calibration", "drawn", "validation", "workspace", "provenance"] {
        assert_eq!(begun["document"][key], report[key], "{key}");
    }
    // The report speaks of the next step too.
    for (effect, said) in begun["document"]["meanings"].as_object().unwrap() {
        assert_eq!(report["meanings"][effect], *said, "{effect}");
    }
    let views = untimed(bench.get("views"));
    for key in ["comparison", "residuals", "telling"] {
        assert_eq!(views[key], report[key], "{key}");
    }
    let effect = begun["live"]["candidates"][0].as_str().unwrap().to_owned();
    assert_eq!(effect, "harmonic:3:202");
    assert_eq!(views["candidates"][0], report["candidates"][0]);
    // A candidate requested by name equals the one of the report.
    let second = report["candidates"][1].clone();
    assert_eq!(bench.act("candidate", &json!({"effect": second["effect"]}))["candidate"], second);

    // The step: the figures of the fit first, then the page; and the fit after it.
    let first = bench.act("switch", &json!({"effect": effect, "on": true}));
    let added = untimed(bench.get("document"));
    let verb = printed(&at, &["add", &effect, "trical", "-o", "added.toml", "--json"]);
    assert_eq!(added["step"], verb);
    assert_eq!((&first["accepted"], &first["objections"]), (&json!(true), &json!([])));
    for (name, of) in [("before", &first["before"]), ("after", &first["after"])] {
        for key in ["residual_mm", "cross_validated_mm", "validation"] {
            assert_eq!(of[key], verb[name][key], "{name}: {key} is never shown with two values");
        }
    }
    assert_eq!(added["document"]["ladder"]["rungs"], json!([verb["before"], verb["after"]]));
    let of_verb = printed(&at, &["diagnose", "trical", "--model", "added.toml", "--json"]);
    for (key, value) in of_verb.as_object().unwrap().iter().filter(|(key, _)| !["sentences", "advice"].contains(&key.as_str()))
    {
        assert_eq!(added["document"]["diagnosis"][key], *value, "{key}");
    }
    let [before, after] = ["before", "after"].map(|k| verb[k]["residual_mm"].as_f64().unwrap());
    assert!(after < 0.5 * before, "the ripple is most of what is left: {before} to {after}");

    // The saved model is the one that `add` writes; the page shows the steps.
    bench.act("save-model", &json!({}));
    assert_eq!(fs::read_to_string(at.join("kept/model.toml")).unwrap(), fs::read_to_string(at.join("added.toml")).unwrap());
    bench.act("save-report", &json!({}));
    let page = fs::read_to_string(at.join("kept/report.html")).unwrap();
    let (_, rest) = page.split_once(r#"id="data">"#).unwrap();
    let saved: Value = serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap();
    assert_eq!(saved["ladder"]["rungs"], added["document"]["ladder"]["rungs"]);

    // Reloading shows the same state; undoing restores the original one.
    assert_eq!(untimed(bench.get("document")), added);
    bench.act("undo", &json!({}));
    assert_eq!(untimed(bench.get("document"))["document"], begun["document"]);
    assert_eq!(bench.ask("POST", "/api/undo", &[], "{}").status, 422);
    bench.act("redo", &json!({}));
    assert_eq!(untimed(bench.get("document"))["document"], added["document"]);
    assert_eq!(bench.ask("POST", "/api/redo", &[], "{}").status, 422);
    bench.act("undo", &json!({}));

    // A step that `add` refuses is refused, but taken if forced.
    let verb = printed(&at, &["add", "harmonic1:5", "trical", "--json"]);
    assert_eq!(verb["accepted"], false, "the example of a step that does not help");
    let refused = bench.act("switch", &json!({"effect": "harmonic1:5", "on": true}));
    assert_eq!(refused["accepted"], false);
    let [told, printed_too] = [&refused["objections"], &verb["objections"]].map(|o| o.as_array().unwrap().clone());
    assert!(!told.is_empty() && printed_too.starts_with(&told), "{told:?}, {printed_too:?}");
    assert_eq!(untimed(bench.get("document"))["document"], begun["document"], "the model is as it was");
    let forced = bench.act("switch", &json!({"effect": "harmonic1:5", "on": true, "force": true}));
    assert_eq!(forced["accepted"], true);
    assert_eq!(bench.get("document")["step"]["after"], verb["after"]);
    bench.act("undo", &json!({}));

    // A ladder that nobody waits for any more leads nowhere.
    let here = untimed(bench.get("document"));
    thread::scope(|scope| {
        let running = scope.spawn(|| bench.ask("POST", "/api/recommend", &[], "{}"));
        while bench.get("progress")["doing"] == "" {
            thread::sleep(Duration::from_millis(5));
        }
        bench.act("cancel", &json!({}));
        let answer = running.join().unwrap();
        assert!(answer.status == 422 && answer.body.contains("Cancelled; the workbench is as it was"), "{}", answer.body);
    });
    assert_eq!(untimed(bench.get("document")), here);

    // The recommendation is that of the ladder, taken in one step.
    let verb = printed(&at, &["ladder", "trical", "-o", "recommended.toml", "--json"]);
    let taken = bench.act("recommend", &json!({}));
    assert_eq!(taken["advice"], verb["advice"]);
    assert_eq!(bench.get("document")["document"]["ladder"]["rungs"].as_array().map(Vec::len), Some(2));
    bench.act("save-model", &json!({}));
    assert_eq!(
        fs::read_to_string(at.join("kept/model.toml")).unwrap(),
        fs::read_to_string(at.join("recommended.toml")).unwrap()
    );
    let nothing = bench.act("recommend", &json!({}));
    assert!(nothing["moved"] == false && nothing["advice"].is_string(), "{nothing}");
    bench.act("undo", &json!({}));

    // The next experiment, and its plan.
    let unasked = bench.ask("POST", "/api/save-plan", &[], "{}");
    assert!(unasked.status == 422 && unasked.body.contains("request the next experiment first"), "{}", unasked.body);
    fs::write(at.join("begin.toml"), "effects = [\"base_frame\", \"mdh\", \"joint_compliance\"]\n").unwrap();
    let verb = printed(&at, &["plan", "next", "trical", "--model", "begin.toml", "--json", "-o", "next.toml"]);
    let next = bench.act("next", &json!({}));
    for key in ["criterion", "rivals", "now", "actions", "best", "not_offered", "sentences", "cell_known"] {
        assert_eq!(next["next"][key], verb[key], "{key}");
    }
    bench.act("save-plan", &json!({}));
    assert_eq!(fs::read_to_string(at.join("kept/plan.toml")).unwrap(), fs::read_to_string(at.join("next.toml")).unwrap());
}

#[test]
fn an_expression_is_fitted_as_a_model_file_has_it_and_a_slip_is_told_at_its_field() {
    let folder = ripple();
    let at = folder.path().join("run");
    let bench = Workbench::start(&at, &["trical", "--save-to", "kept"]);
    let own = |name: &str, unit: &str, site: &str, expressions: &str| {
        let body = json!({"name": name, "unit": unit, "site": site, "expressions": expressions});
        let answer = bench.ask("POST", "/api/own", &[], &body.to_string());
        (answer.status, serde_json::from_str::<Value>(&answer.body).unwrap())
    };
    let slips = [
        (own("teeth", "deg", "theta:3", "sin(202*q3)\ncos(202*q9)"), "expressions", "`q9` is not known"),
        (own("teeth", "deg", "theta:3", "sin(202*q3"), "expressions", "at character"),
        (own("teeth", "deg", "theta:3", " \n"), "expressions", "is empty"),
        (own("teeth", "degrees", "theta:3", "q3"), "unit", "'degrees' is not a known unit"),
        (own("teeth", "mm", "theta:3", "q3"), "unit", "'mm' is not a unit for its sites, which turn"),
        (own("teeth", "deg", "theta:7", "q3"), "site", "'theta:7' is not a site"),
        (own("my teeth", "deg", "theta:3", "q3"), "name", "'my teeth' is not a name"),
        (own("mdh", "deg", "theta:3", "q3"), "name", "already"),
        (own("harmonic1", "deg", "theta:3", "q3"), "name", "catalogue"),
    ];
    for ((status, told), field, because) in slips {
        assert_eq!((status, &told["field"]), (422, &json!(field)), "{told}");
        assert!(told["error"].as_str().unwrap().contains(because), "{told}");
    }
    assert_eq!(bench.get("document")["live"]["can_undo"], false, "a slip changes nothing");

    let (status, fitted) = own("teeth", "deg", "theta:3", "sin(202*q3)\ncos(202*q3)");
    assert_eq!((status, &fitted["accepted"]), (200, &json!(true)), "{fitted}");
    let fitted = bench.get("document");
    bench.act("save-model", &json!({}));
    let verb = printed(&at, &["diagnose", "trical", "--model", "kept/model.toml", "--json"]);
    for key in ["residual_mm", "noise_left_mm", "dof", "verdict", "findings"] {
        assert_eq!(fitted["document"]["diagnosis"][key], verb[key], "{key}");
    }
    // Off, it is not part of the model; on again, it is the same one.
    bench.act("switch", &json!({"effect": "teeth", "on": false}));
    bench.act("save-model", &json!({}));
    assert!(!fs::read_to_string(at.join("kept/model.toml")).unwrap().contains("teeth"));
    bench.act("switch", &json!({"effect": "teeth", "on": true}));
    assert_eq!(without_history(bench.get("document")), without_history(fitted));
}

#[test]
fn a_run_is_opened_as_it_was_judged_and_its_own_files_stay() {
    let folder = ripple();
    let at = folder.path().join("run");
    let before = fs::read_to_string(at.join("report.html")).unwrap();
    let bench = Workbench::start(folder.path(), &["run"]);
    let document = bench.get("document")["document"].clone();
    let report = printed(folder.path(), &["report", "run", "--json"]);
    for key in ["title", "question", "figures", "validation", "campaign", "run", "diagnosis"] {
        assert_eq!(document[key], report[key], "{key}");
    }
    bench.act("save-model", &json!({}));
    bench.act("save-report", &json!({}));
    assert!(at.join("workbench/model.toml").is_file() && at.join("workbench/report.html").is_file());
    assert!(fs::read_to_string(at.join("report.html")).unwrap() == before);
}

#[test]
fn datasets_are_chosen_among_those_that_are_open() {
    let folder = ripple();
    let at = folder.path().join("run");
    let bench = Workbench::start(&at, &["trical", "tracker", "--save-to", "kept"]);
    let both = untimed(bench.get("document"));
    let verb = without_advice(printed(&at, &["diagnose", "trical", "tracker", "--json"]));
    assert_eq!(both["document"]["diagnosis"], verb);
    bench.act("choose", &json!({"datasets": ["tracker"]}));
    let one = bench.get("document");
    let verb = printed(&at, &["diagnose", "tracker", "--json"]);
    for key in ["residual_mm", "samples", "findings", "verdict"] {
        assert_eq!(one["document"]["diagnosis"][key], verb[key], "{key}");
    }
    assert_eq!(bench.ask("POST", "/api/choose", &[], r#"{"datasets": []}"#).status, 422);
    bench.act("undo", &json!({}));
    assert_eq!(untimed(bench.get("document"))["document"], both["document"]);
}

/// A copy of a dataset in which one joint is counted with the opposite sign.
fn with_joint_counted_backwards(from: &Path, to: &Path, column: &str) {
    fs::create_dir(to).unwrap();
    fs::copy(from.join("dataset.toml"), to.join("dataset.toml")).unwrap();
    let text = fs::read_to_string(from.join("samples.csv")).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let place = header.split(',').position(|name| name == column).unwrap();
    let turned = |row: &str| -> String {
        let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
        cells[place] = (-cells[place].parse::<f64>().unwrap()).to_string();
        cells.join(",") + "\n"
    };
    fs::write(to.join("samples.csv"), format!("{header}\n{}", rows.lines().map(turned).collect::<String>())).unwrap();
}

#[test]
fn data_that_do_not_fit_are_opened_by_force_alone_and_the_page_says_so() {
    let folder = ripple();
    let at = folder.path().join("run");
    with_joint_counted_backwards(&at.join("trical"), &at.join("slip"), "q4_deg");
    for verb in ["report", "workbench"] {
        let program = Command::new(env!("CARGO_BIN_EXE_calibench")).current_dir(&at).args([verb, "slip"]).output().unwrap();
        let told = String::from_utf8_lossy(&program.stderr).into_owned();
        assert_eq!(program.status.code(), Some(2), "{verb}: {told}");
        assert!(program.stdout.is_empty() && told.contains("slip/samples.csv") && told.contains("joint 4"), "{verb}: {told}");
    }
    let report = printed(&at, &["report", "slip", "--force", "--json"]);
    let sentence = report["misfit"].as_str().unwrap();
    assert!(sentence.contains("joint 4"), "{sentence}");

    // The sentence appears with the data it refers to, and nowhere else.
    let bench = Workbench::start(&at, &["trical", "slip", "--force", "--save-to", "kept"]);
    assert_eq!(bench.get("document")["document"]["misfit"], report["misfit"]);
    bench.act("choose", &json!({"datasets": ["trical"]}));
    assert_eq!(bench.get("document")["document"]["misfit"], Value::Null);
    bench.act("choose", &json!({"datasets": ["slip"]}));
    let again = bench.get("document");
    assert_eq!(again["document"]["misfit"], report["misfit"]);
    bench.act("save-report", &json!({}));
    assert!(fs::read_to_string(at.join("kept/report.html")).unwrap().contains("joint 4 counted"));
}

#[test]
fn switches_turned_in_any_order_give_the_same_bytes() {
    let folder = ripple();
    let at = folder.path().join("run");
    let bench = Workbench::start(&at, &["trical", "--save-to", "kept"]);
    let turn = |effect: &str, on: bool| {
        let told = bench.act("switch", &json!({"effect": effect, "on": on, "force": true}));
        assert_eq!(told["accepted"], true, "{told}");
        told["after"].to_string()
    };
    let page = || without_history(bench.get("document")).to_string();
    let [a, b, c] = ["harmonic:3:202", "harmonic1:5", "joint_scale:2"];
    let begun = page();
    let mut seen: Vec<(String, String, String)> = Vec::new();
    for order in [[a, b, c], [a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]] {
        let figures = order.map(|effect| turn(effect, true))[2].clone();
        // Judged once, looked up afterwards: the orders differ in what was judged on the way.
        bench.act("save-model", &json!({}));
        let model = fs::read_to_string(at.join("kept/model.toml")).unwrap();
        seen.push((figures, page(), model));
        for effect in order {
            turn(effect, false);
        }
    }
    assert!(seen.iter().all(|s| *s == seen[0]), "an order gives other figures");
    assert_eq!(page(), begun);

    // The same set, fitted by a program that came to it another way.
    let other = Workbench::start(&at, &["trical", "--save-to", "other"]);
    for effect in [c, b, a] {
        other.act("switch", &json!({"effect": effect, "on": true, "force": true}));
    }
    let (same, kept) = (without_history(other.get("document")).to_string(), &seen[0].1);
    // The page names the folder of the model that it recommends to use.
    assert_eq!(same.replace("other/model.toml", "kept/model.toml"), *kept);

    // On, on, off leaves the other, as if it alone had been switched on.
    turn(a, true);
    turn(b, true);
    turn(a, false);
    let live = bench.get("document")["live"].clone();
    assert_eq!(live["effects"], json!(["base_frame", "mdh", "joint_compliance", b]));
    turn(b, false);

    // So do effects of the initial model, where the rest is determined; what is off already is so already.
    turn("joint_compliance", false);
    assert_eq!(bench.get("document")["live"]["effects"], json!(["base_frame", "mdh"]));
    let again = bench.act("switch", &json!({"effect": "joint_compliance", "on": false}));
    assert_eq!((&again["accepted"], &again["moved"]), (&json!(true), &json!(false)));
    turn("joint_compliance", true);
    assert_eq!(page(), begun);
    let never = bench.ask("POST", "/api/switch", &[], r#"{"effect": "joint_scale:5", "on": false}"#);
    assert!(never.status == 422 && never.body.contains("not in the model"), "{}", never.body);
}
