//! Completions and manual pages are made from the command line itself.

use std::process::{Command, Output, Stdio};

fn calibench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calibench")).args(arguments).output().unwrap()
}

#[test]
fn a_shell_accepts_its_completions() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = calibench(&["completions", shell]);
        assert!(output.status.success());
        let script = String::from_utf8(output.stdout).unwrap();
        assert!(
            script.contains("diagnose") && script.contains("--heat-map") || shell == "fish" && script.contains("heat-map"),
            "{shell}"
        );
        if shell == "bash" {
            let mut bash = Command::new("bash").arg("-n").stdin(Stdio::piped()).spawn().unwrap();
            std::io::Write::write_all(&mut bash.stdin.take().unwrap(), script.as_bytes()).unwrap();
            assert!(bash.wait().unwrap().success());
        }
    }
}

#[test]
fn every_verb_has_a_page_of_the_manual_with_its_examples() {
    let folder = tempfile::tempdir().unwrap();
    let output = calibench(&["man", "-o", folder.path().to_str().unwrap()]);
    assert!(output.status.success(), "{output:?}");
    for verb in [
        "calibench",
        "calibench-diagnose",
        "calibench-plan-next",
        "calibench-sim",
        "calibench-sim-study",
        "calibench-robots-show",
    ] {
        assert!(folder.path().join(format!("{verb}.1")).is_file(), "{verb}");
    }
    let page = std::fs::read_to_string(folder.path().join("calibench-keep-check.1")).unwrap();
    assert!(page.contains("sentinels") && page.contains("calibench keep check calibration.toml"), "{page}");
    let page = std::fs::read_to_string(folder.path().join("calibench-diagnose.1")).unwrap();
    assert!(page.starts_with(".ie") && page.contains("calibench diagnose runs/paper/trical"), "{page}");
}

#[test]
fn an_old_name_of_a_verb_is_refused_in_one_line_with_its_new_one() {
    for (old, new) in [
        ("check", "keep check"),
        ("design", "sim design"),
        ("fleet", "keep fleet"),
        ("gallery", "effects gallery"),
        ("merge", "sim merge"),
        ("next", "plan next"),
        ("precision", "sim precision"),
        ("prove", "effects prove"),
        ("repeatability", "cell repeatability"),
        ("runs", "keep runs"),
        ("serve", "sim serve"),
        ("study", "sim study"),
        ("suite", "sim suite"),
    ] {
        for arguments in [&[old][..], &[old, "scenarios/paper.toml", "--json"], &[old, "--help"], &["help", old]] {
            let output = calibench(arguments);
            assert_eq!(output.status.code(), Some(2), "{arguments:?}");
            let told = String::from_utf8(output.stderr).unwrap();
            assert_eq!(told, format!("calibench: `calibench {old}` is `calibench {new}`\n"), "{arguments:?}");
            assert!(output.stdout.is_empty());
        }
    }
}

#[test]
fn what_alone_was_a_verb_remains_one_beside_the_verbs_in_it() {
    let text = |arguments: &[&str]| {
        let output = calibench(arguments);
        assert!(output.status.success(), "{arguments:?}: {output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(text(&["effects"]), text(&["effects", "list"]));
    assert_eq!(text(&["effects", "harmonic"]), text(&["effects", "list", "harmonic"]));
    assert_eq!(text(&["effects", "--json"]), text(&["effects", "list", "--json"]));
    let [top, inner] = [text(&["run", "--help"]), text(&["sim", "run", "--help"])];
    assert!(top.contains("Usage: calibench run ") && inner.contains("Usage: calibench sim run "), "{top}{inner}");
    for (arguments, told) in [
        (&["plan"][..], "SCENARIO|CELL"),
        (&["plan", "nowhere.toml"], "nowhere.toml"),
        (&["plan", "next"], "DATASETS"),
        (&["plan", "next", "nowhere"], "nowhere"),
    ] {
        let output = calibench(arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && error.contains(told), "{arguments:?}: {error}");
    }
}
