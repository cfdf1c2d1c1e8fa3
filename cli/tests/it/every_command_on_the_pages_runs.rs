//! Every command on every page runs, and prints what the page shows; what cannot run here is at least understood by the program.
//! `tests/pages/run` tells how pages say which is which. Pages that go on in the folder of another are run with it.
//!
//! `CALIBENCH_WRITE_README=1 tests/run -E 'test(every_command_on_the_pages_runs)'` writes the program's present output into the
//! pages.

#![cfg(unix)]

use std::path::Path;
use std::process::Command;

/// Output of the script; `None` where Python is missing.
fn script(arguments: &[&str]) -> Option<String> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/pages/run");
    let output = match Command::new(script).arg(env!("CARGO_BIN_EXE_calibench")).args(arguments).output() {
        Ok(output) => output,
        Err(e) if std::env::var_os("CALIBENCH_REQUIRE_ALL").is_some() => panic!("tests/pages/run needs Python: {e}"),
        Err(e) => {
            println!("the pages are not run: no Python: {e}");
            return None;
        }
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

macro_rules! pages {
    ($($name:ident: $page:literal,)*) => {
        const PAGES: &[&str] = &[$($page),*];

        $(
            #[test]
            fn $name() {
                script(&[$page]);
            }
        )*
    };
}

pages! {
    readme: "README.md",
    adaptive: "docs/adaptive.md",
    after_a_crash: "docs/after-a-crash.md",
    calibrate: "docs/calibrate.md",
    check: "docs/check.md",
    the_run: "docs/the-run.md",
    discover: "docs/discover.md",
    gauge: "docs/first-hour/gauge.md",
    own_effect: "docs/first-hour/own-effect.md",
    tracker: "docs/first-hour/tracker.md",
    fleets: "docs/fleets.md",
    hand_eye: "docs/hand-eye.md",
    importing: "docs/importing.md",
    install: "docs/install.md",
    logs: "docs/logs.md",
    robot_files: "docs/robot-files.md",
    runs: "docs/runs.md",
    studies: "docs/studies/README.md",
}

#[test]
fn no_page_with_commands_is_forgotten() {
    if let Some(pages) = script(&["--list"]) {
        assert_eq!(pages.lines().collect::<Vec<_>>(), PAGES);
    }
}

#[test]
fn every_call_of_the_program_is_understood() {
    script(&["--only-calls"]);
}
