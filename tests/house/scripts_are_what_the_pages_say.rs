//! The scripts of the repository: the pages tell of them, they can be executed, and `.ci/run` runs the two commands of the README;
//! the page of the statistical studies tells of each.

use std::collections::BTreeSet;
use std::path::Path;

use crate::{PACKAGES, read, root, sources};

/// The first two commands of the README.
fn opening_commands() -> Vec<String> {
    let first_block = read("README.md").split("```sh\n").nth(1).and_then(|rest| rest.split("```").next().map(str::to_owned));
    first_block.expect("the README opens with commands").lines().map(str::to_owned).collect()
}

#[test]
fn the_script_of_all_checks_runs_the_commands_of_the_readme() {
    let script = read(".ci/run");
    let commands = opening_commands();
    assert_eq!(commands.len(), 2, "the README opens with two commands: {commands:?}");
    assert_eq!(commands[1], "tests/run", "the second runs all tests");
    for command in commands {
        assert!(script.lines().any(|line| line.trim().ends_with(&command)), ".ci/run does not run `{command}`");
    }
    assert!(script.contains("export CALIBENCH_REQUIRE_ALL=1"), ".ci/run would pass over tests that are skipped");
}

/// The command of a page's block `sh` that begins with these words, and the block of text below it.
fn shown(page: &str, words: &str) -> String {
    let text = read(page);
    let command = text.lines().find(|line| line.starts_with(words)).unwrap_or_else(|| panic!("{page} runs no {words}"));
    let below = text.split_once(command).unwrap().1;
    let printed = below.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).expect("its output is shown");
    format!("```console\n$ {command}\n{printed}```\n")
}

/// The README shows what the page of the command does, whose output is held to the program's.
/// `CALIBENCH_WRITE_README=1 cargo test -p calibench-house` copies it.
#[test]
fn the_block_of_the_readme_is_that_of_its_page() {
    let now = shown("docs/calibrate.md", "calibench calibrate ");
    let text = read("README.md");
    let from = text.find("<!-- block:").and_then(|at| Some(at + text[at..].find('\n')? + 1)).expect("the README has its place");
    let to = from + text[from..].find("<!-- end -->").expect("the place ends");
    if std::env::var_os("CALIBENCH_WRITE_README").is_some() {
        let written = format!("{}{now}{}", &text[..from], &text[to..]);
        std::fs::write(crate::root().join("README.md"), written).unwrap();
    } else {
        assert_eq!(&text[from..to], now, "README.md (left) and docs/calibrate.md; copy it with `CALIBENCH_WRITE_README=1`");
    }
}

#[cfg(unix)]
#[test]
fn each_is_on_a_page_and_can_be_executed() {
    use std::os::unix::fs::PermissionsExt;
    let on = ["README.md", "CONTRIBUTING.md", "docs/README.md", "docs/install.md", "docs/repository.md", "docs/validation.md"];
    let pages = on.map(read).concat();
    for script in
        ["tests/quick", "tests/run", "validation/run", "sim/setup.sh", ".ci/run", "docs/robots/make", "docs/book/make"]
    {
        assert!(pages.contains(script), "no page tells of {script}");
        let metadata = std::fs::metadata(root().join(script)).unwrap_or_else(|e| panic!("{script}: {e}"));
        assert!(metadata.permissions().mode() & 0o111 == 0o111, "{script} is not executable");
    }
}

#[test]
fn every_study_is_on_its_page() {
    let mut found = BTreeSet::new();
    for (path, text) in PACKAGES.into_iter().chain(["tests/it"]).flat_map(sources) {
        let name = Path::new(&path).file_stem().unwrap().to_string_lossy();
        for reason in text.lines().filter(|line| line.trim_start().starts_with("#[ignore")) {
            assert!(reason.contains(&format!("validation/run {name}\"")), "{path}: {reason}");
            found.insert(name.clone().into_owned());
        }
    }
    let page = read("docs/validation-studies.md");
    let told: BTreeSet<String> =
        page.lines().filter_map(|l| l.strip_prefix("| `")?.split('`').next().map(Into::into)).collect();
    assert_eq!(told, found, "studies of the page (left) and of the tests (right)");
}
