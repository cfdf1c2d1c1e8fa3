//! The files of a scenario: its own, followed by those that it extends.

use std::path::{Path, PathBuf};

use calibench::files::{FileError, field_error, parse_toml, read_text};
use toml::{Table, Value};

/// Limit on the length of a chain of extended files; more are taken for a mistake.
const MOST_FILES: usize = 8;

/// Paths and texts of the files, the scenario's own first, each followed by the one it extends.
#[derive(Debug, Clone)]
pub(super) struct Sources(Vec<(PathBuf, String)>);

impl Sources {
    /// Reads a scenario file and the files it extends, and merges their keys, each file over the one it extends. The
    /// expectations of a file apply to its own question only: `[expect]` is not inherited.
    pub fn read(path: &Path) -> Result<(Sources, Table), FileError> {
        let mut files = Vec::new();
        let mut layers = Vec::new();
        let mut next = Some(path.to_owned());
        while let Some(path) = next {
            let text = read_text(&path).map_err(|e| of_extending(&files, &path, e))?;
            let mut keys: Table = parse_toml(&path, &text)?;
            if !files.is_empty() {
                keys.remove("expect");
            }
            files.push((path, text));
            next = extended(&files, keys.remove("extends"))?;
            layers.push(keys);
        }
        let mut merged = Table::new();
        for layer in layers.into_iter().rev() {
            merge(&mut merged, layer);
        }
        Ok((Sources(files), merged))
    }

    /// Folder of the file that gives a key of the first level; a path in it is relative to that file.
    pub fn folder_of(&self, key: &str) -> PathBuf {
        let gives = |text: &str| text.parse::<Table>().is_ok_and(|keys| keys.contains_key(key));
        let file = self.0.iter().find(|(_, text)| gives(text)).or(self.0.first());
        file.and_then(|(path, _)| path.parent()).unwrap_or(Path::new(".")).to_owned()
    }

    /// Builds an error for a key, in the file that contains most of the key's path; the first file if several do.
    pub fn wrong(&self, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        // Lists are replaced as a whole: the file with the list has its elements.
        let tables: Vec<&str> = key.split('[').next().unwrap_or(key).split('.').collect();
        let depth = |text: &str| {
            let Ok(root) = text.parse::<Table>() else { return 0 };
            let root = Value::Table(root);
            let mut at = Some(&root);
            tables
                .iter()
                .take_while(|name| {
                    at = at.and_then(|v| v.get(**name));
                    at.is_some()
                })
                .count()
        };
        // `max_by_key` returns the last of equal elements.
        match self.0.iter().rev().max_by_key(|(_, text)| depth(text)) {
            Some((path, text)) => field_error(path, text, key, problem, remedy),
            None => FileError::whole(Path::new("scenario"), problem, remedy),
        }
    }
}

/// Attributes an unreadable file to the file that names it.
fn of_extending(files: &[(PathBuf, String)], path: &Path, error: FileError) -> FileError {
    match files.last() {
        Some((by, text)) => {
            let problem = format!("'{}' {}", path.display(), error.problem);
            field_error(by, text, "extends", problem, "name an existing scenario file")
        }
        None => error,
    }
}

/// Path of the file that the last of `files` extends.
fn extended(files: &[(PathBuf, String)], extends: Option<Value>) -> Result<Option<PathBuf>, FileError> {
    let (Some(extends), Some((path, text))) = (extends, files.last()) else { return Ok(None) };
    let wrong = |problem: String, remedy: &str| Err(field_error(path, text, "extends", problem, remedy));
    let Value::String(name) = extends else {
        return wrong("is not a file name".into(), "name one scenario file, in quotes");
    };
    let next = path.parent().unwrap_or(Path::new(".")).join(name);
    // The same file may have several spellings.
    let same = |other: &Path| next == other || next.canonicalize().is_ok_and(|n| other.canonicalize().is_ok_and(|o| n == o));
    if let Some(first) = files.iter().position(|(other, _)| same(other)) {
        let names = files[first..].iter().map(|(p, _)| p).chain([&next]);
        let names: Vec<String> = names.map(|p| p.file_name().unwrap_or_default().to_string_lossy().into_owned()).collect();
        return wrong(
            format!("goes round in a circle: {}", names.join(" extends ")),
            "extend a file that does not lead back to this one",
        );
    }
    if files.len() == MOST_FILES {
        return wrong(format!("is the {MOST_FILES}th of a chain"), "extend over fewer files");
    }
    Ok(Some(next))
}

fn merge(under: &mut Table, over: Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => merge(below, above),
            (_, value) => {
                under.insert(key, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn chain(links: &[(&str, &str)], first: &str) -> Result<Table, FileError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in links {
            fs::write(folder.path().join(name), text).expect("writable");
        }
        Sources::read(&folder.path().join(first)).map(|(_, merged)| merged)
    }

    #[test]
    fn the_nearest_file_of_a_chain_has_the_last_word() {
        let merged = chain(
            &[
                ("a", "extends = 'b'\nx = 1\n[t]\np = 1"),
                ("b", "extends = 'c'\nx = 2\ny = 2\n[t]\nq = 2"),
                ("c", "y = 3\nz = 3\n[t]\np = 3"),
            ],
            "a",
        );
        assert_eq!(merged.expect("a chain"), "x = 1\ny = 2\nz = 3\n[t]\np = 1\nq = 2".parse::<Table>().expect("TOML"));
    }

    #[test]
    fn a_circle_and_an_endless_chain_are_named() {
        let circle = chain(&[("a", "extends = 'b'"), ("b", "\nextends = './a'")], "a").expect_err("a circle");
        assert!(circle.to_string().contains("a extends b extends a") && circle.line == Some(2), "{circle}");
        let links: Vec<(String, String)> = (0..20).map(|k| (format!("{k}"), format!("extends = '{}'", k + 1))).collect();
        let links: Vec<(&str, &str)> = links.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
        let endless = chain(&links, "0").expect_err("too long");
        assert!(endless.problem.contains("chain") && endless.path.ends_with("7"), "{endless}");
    }
}
