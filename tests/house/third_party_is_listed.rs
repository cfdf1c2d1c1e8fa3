//! `docs/third-party.md` lists every direct dependency, in the version that is locked, under the licence that it states.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use crate::root;

/// Tables of a `Cargo.toml` that name dependencies, and how the page marks packages that are in no other.
const KINDS: [(&str, &str); 3] = [("dependencies", ""), ("dev-dependencies", " (tests)"), ("build-dependencies", " (build)")];

/// A row of the page but for its licence: the version, and the packages that use it.
#[derive(Debug, PartialEq)]
struct Row {
    version: String,
    users: String,
}

fn read(path: &Path) -> Table {
    std::fs::read_to_string(path).unwrap().parse().unwrap()
}

fn text<'a>(table: &'a Table, key: &str) -> &'a str {
    table[key].as_str().unwrap()
}

/// The dependencies that a manifest names, with the mark of their kind; packages of this workspace are none.
fn direct(manifest: &Table) -> BTreeMap<String, &'static str> {
    let for_targets = manifest.get("target").and_then(Value::as_table).into_iter().flat_map(|t| t.values());
    let places: Vec<&Table> = std::iter::once(manifest).chain(for_targets.filter_map(Value::as_table)).collect();
    let mut found = BTreeMap::new();
    for (kind, mark) in KINDS {
        for named in places.iter().filter_map(|place| place.get(kind)?.as_table()).flat_map(Table::keys) {
            if !named.starts_with("calibench") {
                found.entry(named.clone()).or_insert(mark);
            }
        }
    }
    found
}

/// The version of a dependency of a package; the lock file tells it apart where there are several.
fn locked(lock: &[Value], package: &str, dependency: &str) -> String {
    let entries = |name: &str| lock.iter().filter_map(Value::as_table).filter(|p| text(p, "name") == name).collect::<Vec<_>>();
    let named = entries(package)[0]["dependencies"].as_array().unwrap().iter().filter_map(Value::as_str);
    let entry = named.map(|d| d.split(' ').collect::<Vec<_>>()).find(|words| words[0] == dependency).unwrap();
    entry.get(1).map_or_else(|| text(entries(dependency)[0], "version").into(), |version| (*version).into())
}

/// Rows that the page must have, by name.
fn expected() -> BTreeMap<String, Row> {
    let lock = read(&root().join("Cargo.lock"));
    let packages = lock["package"].as_array().unwrap();
    let mut rows: BTreeMap<String, Row> = BTreeMap::new();
    for member in read(&root().join("Cargo.toml"))["workspace"]["members"].as_array().unwrap() {
        let manifest = read(&root().join(member.as_str().unwrap()).join("Cargo.toml"));
        let package = text(manifest["package"].as_table().unwrap(), "name");
        for (dependency, mark) in direct(&manifest) {
            let user = format!("{}{mark}", package.trim_start_matches("calibench-"));
            let row = rows
                .entry(dependency.clone())
                .or_insert_with(|| Row { version: locked(packages, package, &dependency), users: String::new() });
            row.users =
                [row.users.as_str(), user.as_str()].into_iter().filter(|u| !u.is_empty()).collect::<Vec<_>>().join(", ");
        }
    }
    rows
}

/// Value of a key in a package's own manifest, where cargo keeps its source here.
fn stated(name: &str, version: &str, key: &str) -> Option<String> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cargo")))?;
    let registries = std::fs::read_dir(home.join("registry/src")).ok()?;
    let manifest = registries
        .filter_map(|registry| Some(registry.ok()?.path().join(format!("{name}-{version}")).join("Cargo.toml")))
        .find(|path| path.exists())?;
    Some(read(&manifest)["package"].get(key)?.as_str()?.into())
}

#[test]
fn every_direct_dependency_is_listed_as_it_is() {
    let page = std::fs::read_to_string(root().join("docs/third-party.md")).unwrap();
    let table = page.lines().skip_while(|line| !line.starts_with("|---")).skip(1).take_while(|line| line.starts_with('|'));
    let mut listed = BTreeMap::new();
    let mut licences = 0;
    for line in table {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let &[name, version, licence, users] = &cells[..] else { panic!("not four cells: {line}") };
        if let Some(stated) = stated(name, version, "license") {
            assert_eq!(licence, stated, "{name} {version}");
            licences += 1;
        }
        assert!(listed.insert(name.to_owned(), Row { version: version.into(), users: users.into() }).is_none(), "{name} twice");
    }
    let expected = expected();
    for (name, row) in &expected {
        assert_eq!(listed.get(name), Some(row), "{name}, in docs/third-party.md and as it is");
    }
    let stale: Vec<&String> = listed.keys().filter(|name| !expected.contains_key(*name)).collect();
    assert!(stale.is_empty(), "no longer dependencies: {stale:?}");
    println!("{licences} of {} licences held against the packages themselves", listed.len());
}

/// Major, minor and patch number of a version of Rust.
fn numbers(version: &str) -> [u32; 3] {
    let mut parts = version.split('.').map(|part| part.parse().unwrap());
    [(); 3].map(|()| parts.next().unwrap_or(0))
}

/// A lint of clippy holds our own use of the standard library to the stated version.
#[test]
fn no_dependency_needs_a_newer_rust_than_this_workspace_states() {
    let manifest = read(&root().join("Cargo.toml"));
    let ours = manifest["workspace"]["package"]["rust-version"].as_str().unwrap();
    let lock = read(&root().join("Cargo.lock"));
    let mut checked = 0;
    for package in lock["package"].as_array().unwrap().iter().filter_map(Value::as_table) {
        let (name, version) = (text(package, "name"), text(package, "version"));
        if let Some(needed) = stated(name, version, "rust-version") {
            assert!(numbers(&needed) <= numbers(ours), "{name} {version} needs Rust {needed}; this workspace states {ours}");
            checked += 1;
        }
    }
    assert!(checked > 50, "only {checked} packages state the Rust that they need");
}
