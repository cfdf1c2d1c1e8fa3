//! `effects prove DATASET` injects every effect of the catalogue and tells the truth about what came of it.

use std::path::Path;
use std::process::{Command, Output};

use crate::program::run_of;
use serde_json::Value;

fn calibench(folder: &Path, threads: &str, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.current_dir(folder).env("RAYON_NUM_THREADS", threads).args(arguments).output().unwrap()
}

fn done(folder: &Path, threads: &str, arguments: &[&str]) -> String {
    let output = calibench(folder, threads, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn count(share: &Value) -> [u64; 2] {
    ["hits", "of"].map(|key| share[key].as_u64().unwrap())
}

#[test]
fn effects_that_the_data_see_are_named_and_sized_and_nothing_is_no_effect() {
    let folder = run_of("table8.toml");
    let folder = folder.path();

    let printed = done(folder, "2", &["effects", "prove", "run/trical", "--json", "--seed", "7", "-o", "page.html"]);
    let found: Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(found["format"], "calibench-injections/1");
    let effects = found["effects"].as_array().unwrap();
    let number = |e: &Value, key: &str| e[key].as_f64().unwrap();

    // What is significant above the noise is named, with an honest size, and the error falls; what leaves nothing is not named.
    let seen: Vec<&Value> = effects.iter().filter(|e| number(e, "visible") > 0.8).collect();
    let named: Vec<&&Value> = seen.iter().filter(|e| e["named"] == true).collect();
    assert!(seen.len() > 40 && named.len() as f64 > 0.95 * seen.len() as f64, "{} of {}", named.len(), seen.len());
    let [within, sized] = count(&found["within_2_sigma"]);
    // 95.45 % expected: fewer than 88 % of a hundred have a chance below 0.2 %.
    assert!(sized > 60 && within as f64 > 0.88 * sized as f64, "{within} of {sized}");
    let fell = named.iter().filter(|e| number(e, "after_mm") < number(e, "before_mm")).count();
    assert!(fell as f64 > 0.9 * named.len() as f64, "{fell} of {}", named.len());
    for e in effects.iter().filter(|e| number(e, "visible") < 0.02) {
        assert_eq!(e["named"], false, "{e}");
    }
    let [alarms, trials] = count(&found["false_alarms"]);
    assert!(trials == 20 && alarms <= 1, "{alarms} of {trials}");
    let families: u64 = found["families"].as_array().unwrap().iter().map(|f| count(&f["found"])[1]).sum();
    assert_eq!(families, effects.len() as u64);
    assert_eq!(count(&found["named"])[0], effects.iter().filter(|e| e["named"] == true).count() as u64);

    // One family alone is the same as among all, on one thread as on two; the page says every effect and asks for nothing.
    let alone = done(
        folder,
        "1",
        &["effects", "prove", "run/trical", "--json", "--seed", "7", "--effect", "joint_scale", "--nothing", "0"],
    );
    let alone: Value = serde_json::from_str(&alone).unwrap();
    let among: Vec<&Value> = effects.iter().filter(|e| e["effect"].as_str().unwrap().starts_with("joint_scale:")).collect();
    assert_eq!(alone["effects"].as_array().unwrap().iter().collect::<Vec<_>>(), among);
    let page = std::fs::read_to_string(folder.join("page.html")).unwrap();
    assert!(!page.contains("{{") && !page.contains("http://") && !page.contains("https://"));
    for e in effects {
        assert!(page.contains(e["effect"].as_str().unwrap()), "{e}");
    }

    // Beside all that a crippled model lacks, less is seen.
    std::fs::write(folder.join("geometry.toml"), "effects = [\"base_frame\", \"mdh\"]\n").unwrap();
    let beside = ["--model", "geometry.toml", "--noise", "residual", "--nothing", "0", "--effect", "joint_scale", "--json"];
    let beside: Value =
        serde_json::from_str(&done(folder, "2", &[&["effects", "prove", "run/trical"], &beside[..]].concat())).unwrap();
    assert_eq!(beside["noise"]["source"], "residual");
    let named = among.iter().filter(|e| e["named"] == true).count() as u64;
    assert!(count(&beside["named"])[0] < named, "{} of {named}", beside["named"]);
}

#[test]
fn a_mistaken_question_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, says) in [
        (&["effects", "prove", "nothing-here"][..], "nothing-here/dataset.toml"),
        (&["effects", "prove", "x", "--folds", "3", "--noise", "residual"], "--noise"),
        (&["effects", "prove", "x", "-o", "."], "is a directory"),
    ] {
        let output = calibench(folder.path(), "2", arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(says), "{arguments:?}: {output:?}");
    }
}
