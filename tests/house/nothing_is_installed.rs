//! What a function needs is handed to it: nothing is installed in the process, where a second caller would be ignored without a
//! word.

use crate::{production, production_sources};

/// Types of statics that can be written once or again.
const WRITABLE: [&str; 6] = ["OnceLock<", "OnceCell<", "LazyLock<", "Mutex<", "RwLock<", "Atomic"];

/// Statics that are what the process has one of: file, name, and what it is.
const ONE_A_PROCESS: [(&str, &str, &str); 7] = [
    ("src/files/memory.rs", "FILES", "the files of a program that has no disk"),
    ("src/files/streams.rs", "HELD", "standard output"),
    ("cli/src/terminal/output.rs", "MANNER", "the terminal"),
    ("sim/mujoco/src/python.rs", "MUJOCO", "the embedded Python"),
    ("web/src/called.rs", "ROOM", "the memory that a page reads and writes"),
    ("web/src/called.rs", "ANSWER", "the memory that a page reads and writes"),
    ("web/src/called.rs", "SESSION", "what the page has open"),
];

/// Names of the statics of a source that can be written.
fn writable(source: &str) -> impl Iterator<Item = &str> {
    production(source).filter_map(|line| {
        let (before, declared) = line.trim_start().split_once("static ")?;
        let is_visibility = before.is_empty() || before.starts_with("pub");
        let (name, is) = declared.trim_start_matches("mut ").split_once(": ")?;
        (is_visibility && WRITABLE.iter().any(|text| is.contains(text))).then_some(name)
    })
}

#[test]
fn nothing_is_installed_in_the_process() {
    let mut found = Vec::new();
    for (path, source) in production_sources() {
        found.extend(writable(&source).map(|name| (path.clone(), name.to_owned())));
    }
    for (path, name) in &found {
        let is_known = ONE_A_PROCESS.iter().any(|(file, known, _)| file == path && known == name);
        assert!(is_known, "{path}: hand on what `{name}` holds, as an argument or a field");
    }
    for (path, name, what) in ONE_A_PROCESS {
        assert!(found.iter().any(|(file, known)| file == path && known == name), "{path}: `{name}`, {what}, is gone");
    }
}

#[test]
fn an_installed_value_is_found() {
    let source = "static A: OnceLock<u8> = OnceLock::new();\npub(crate) static B: Mutex<u8> = Mutex::new(0);\nstatic C: u8 = 0;\n\
        fn f(x: &'static Mutex<u8>) {}\n    static D: AtomicBool = AtomicBool::new(false);\n// static E: Mutex<u8>";
    assert_eq!(writable(source).collect::<Vec<_>>(), ["A", "B", "D"]);
}
