//! `effects gallery` writes the gallery of the documentation byte for byte, and that of a user's own data; nothing else is touched.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn calibench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calibench")).current_dir(root()).args(arguments).output().unwrap()
}

/// Three families stand for all: the whole gallery takes a minute.
#[test]
fn the_pictures_of_the_documentation_are_those_that_the_program_draws() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("gallery");
    let output = calibench(&[
        "effects",
        "gallery",
        "scenarios/gallery.toml",
        "-o",
        out.to_str().unwrap(),
        "--effect",
        "harmonic",
        "--effect",
        "base_step",
        "--effect",
        "outlier",
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for name in ["harmonic.md", "harmonic.svg", "base_step.md", "base_step.svg", "outlier.md", "outlier.svg"] {
        let [drawn, kept] = [out.join(name), root().join("docs/gallery").join(name)].map(|f| fs::read_to_string(f).unwrap());
        assert_eq!(
            drawn, kept,
            "{name}: write it again with `calibench effects gallery scenarios/gallery.toml -o docs/gallery`"
        );
    }
    assert!(!out.join("ball.md").exists());
    let index = fs::read_to_string(out.join("README.md")).unwrap();
    assert!(index.contains("base_step.md") && !index.contains("(ball.md)"), "{index}");
}

#[test]
fn what_cannot_be_drawn_is_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("notes.txt");
    fs::write(&kept, "mine").unwrap();
    let there = folder.path().to_str().unwrap();
    let new = folder.path().join("new");
    let new = new.to_str().unwrap();
    for (arguments, says) in [
        (vec!["effects", "gallery", "scenarios/gallery.toml", "-o", there], "gallery"),
        (vec!["effects", "gallery", "scenarios/gallery.toml", "-o", new, "--effect", "gremlins"], "--effect gremlins"),
        (vec!["effects", "gallery", "scenarios/gallery.toml", "elsewhere", "-o", new], "one scenario file, or dataset folders"),
        (vec!["effects", "gallery", "nowhere", "-o", new], "nowhere"),
        (vec!["effects", "gremlins"], "'gremlins' is not an effect"),
    ] {
        let output = calibench(&arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert!(error.contains(says), "{arguments:?}: {error}");
    }
    assert_eq!(fs::read_to_string(kept).unwrap(), "mine");
    assert!(!Path::new(new).exists(), "nothing is half-written");
}

#[test]
fn an_effect_is_told_in_full_with_its_page() {
    let output = calibench(&["effects", "harmonic"]);
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.contains("docs/gallery/harmonic.md") && told.contains("Folded onto one period"), "{told}");
    assert!(root().join("docs/gallery/harmonic.md").is_file());
}
