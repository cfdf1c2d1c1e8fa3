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
    let pages: Vec<String> =
        std::fs::read_dir(folder.path()).unwrap().map(|page| page.unwrap().file_name().into_string().unwrap()).collect();
    assert!(pages.contains(&"calibench.1".to_owned()) && pages.len() == 33, "{pages:?}");
    let page = std::fs::read_to_string(folder.path().join("calibench-diagnose.1")).unwrap();
    assert!(page.starts_with(".ie") && page.contains("calibench diagnose runs/paper/trical"), "{page}");
}
