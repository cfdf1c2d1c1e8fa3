//! Files are written whole or not at all, and errors in them name the file, the line, the field and the remedy.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What is wrong with a file, where, and what to do about it.
#[derive(Debug, Error)]
#[error("{}{}{}: {problem}; {remedy}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default(), if field.is_empty() { String::new() } else { format!(": {field}") })]
pub struct FileError {
    /// The file.
    pub path: PathBuf,
    /// Line, counted from 1, where one is to blame.
    pub line: Option<usize>,
    /// Key or column.
    pub field: String,
    /// What is wrong.
    pub problem: String,
    /// What to do.
    pub remedy: String,
}

impl FileError {
    /// An error of the whole file.
    pub fn whole(path: &Path, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        FileError { path: path.into(), line: None, field: String::new(), problem: problem.into(), remedy: remedy.into() }
    }
}

/// Reads a text file.
///
/// # Errors
/// When it cannot be read, is a directory, is empty, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    if path.is_dir() {
        return Err(FileError::whole(path, "is a directory", "name a file"));
    }
    let bytes = std::fs::read(path).map_err(|e| FileError::whole(path, e.to_string(), "check the path and its permissions"))?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        FileError { line: Some(line), ..FileError::whole(path, "is not UTF-8 text", "save it as UTF-8") }
    })?;
    if text.trim().is_empty() {
        return Err(FileError::whole(path, "is empty", "give a file with content"));
    }
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// Writes a file whole: to a temporary name in the same folder, synced, then renamed.
///
/// # Errors
/// When the folder cannot be written.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<(), FileError> {
    let fail = |e: std::io::Error| {
        FileError::whole(path, format!("cannot be written: {e}"), "check the folder, its permissions and free space")
    };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(fail)?;
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(fail)?;
    file.write_all(content).and_then(|()| file.as_file().sync_all()).map_err(fail)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644)).map_err(fail)?;
    }
    file.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}

/// Reads TOML text into `T`.
///
/// # Errors
/// When it is not TOML, or a key is unknown, missing, or of the wrong type; with the line and the key.
pub fn parse_toml<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, FileError> {
    toml::from_str(text).map_err(|e| {
        let offset = e.span().map(|span| span.start);
        let message = e.message().replace('\n', ", ");
        let mut field = offset.and_then(|at| key_at(text, at)).unwrap_or_default();
        let remedy = if let Some(missing) = message.strip_prefix("missing field `").and_then(|m| m.strip_suffix('`')) {
            field = if field.is_empty() { missing.to_owned() } else { format!("{field}.{missing}") };
            format!("add the key `{missing}`")
        } else if message.starts_with("unknown field") {
            "correct the spelling of the key or remove it".to_owned()
        } else if message.starts_with("invalid") {
            "give a value of the expected kind".to_owned()
        } else {
            "correct the TOML syntax here".to_owned()
        };
        FileError { path: path.into(), line: offset.map(|at| line_of(text, at)), field, problem: message, remedy }
    })
}

/// The error of the key `key_path`, written like `link[2].mass_kg` with places counted from 0; its line is looked up in `text`.
///
/// Where the key itself is absent, the line is that of the innermost table of the path that is there.
pub fn field_error(
    path: &Path,
    text: &str,
    key_path: &str,
    problem: impl Into<String>,
    remedy: impl Into<String>,
) -> FileError {
    FileError {
        path: path.into(),
        line: offset_of(text, key_path).map(|at| line_of(text, at)),
        field: key_path.into(),
        problem: problem.into(),
        remedy: remedy.into(),
    }
}

/// Line, counted from 1, of a byte of the text.
fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&b| b == b'\n').count()
}

/// Byte at which the key of a path stands, or the innermost part of the path that exists.
fn offset_of(text: &str, key_path: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut table = document.get_ref();
    let mut found = None;
    for part in key_path.split('.') {
        let (name, places) = part.split_once('[').unwrap_or((part, ""));
        let Some((key, value)) = table.iter().find(|(key, _)| key.get_ref() == name) else {
            break;
        };
        found = Some(key.span().start);
        let mut value = value;
        for place in places.split('[').filter_map(|p| p.trim_end_matches(']').parse::<usize>().ok()) {
            let Some(element) = value.get_ref().as_array().and_then(|a| a.get(place)) else {
                return found;
            };
            found = Some(element.span().start);
            value = element;
        }
        let Some(inner) = value.get_ref().as_table() else { break };
        table = inner;
    }
    found
}

/// The path of the innermost key or element that holds a byte of the text.
fn key_at(text: &str, offset: usize) -> Option<String> {
    fn within_table(table: &DeTable<'_>, offset: usize) -> Option<String> {
        let hit = table.iter().find(|(key, value)| key.span().contains(&offset) || value.span().contains(&offset));
        // The span of `[[link]]` covers its header only: what follows belongs to it all the same.
        let (key, value) = hit.or_else(|| table.iter().find(|(_, value)| within_value(value.get_ref(), offset).is_some()))?;
        Some(format!("{}{}", key.get_ref(), within_value(value.get_ref(), offset).unwrap_or_default()))
    }
    fn within_value(value: &DeValue<'_>, offset: usize) -> Option<String> {
        if let Some(table) = value.as_table() {
            return within_table(table, offset).map(|rest| format!(".{rest}"));
        }
        let array = value.as_array()?;
        let place = |(k, element): (usize, &Spanned<DeValue<'_>>)| {
            let rest = within_value(element.get_ref(), offset);
            (rest.is_some() || element.span().contains(&offset)).then(|| format!("[{k}]{}", rest.unwrap_or_default()))
        };
        array.iter().enumerate().find_map(place)
    }
    within_table(DeTable::parse(text).ok()?.get_ref(), offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Link {
        mass_kg: f64,
        com_mm: Option<[f64; 3]>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Arm {
        name: String,
        link: Vec<Link>,
    }

    fn error(text: &str) -> (Option<usize>, String) {
        let e = parse_toml::<Arm>(Path::new("arm.toml"), text).unwrap_err();
        assert!(!e.problem.is_empty() && !e.remedy.is_empty());
        (e.line, e.field)
    }

    #[test]
    fn a_wrong_key_is_named_with_its_line() {
        let text = "name = 'x'\n[[link]]\nmass_kg = 1.0\n\n[[link]]\n";
        assert_eq!(error(&format!("{text}mass_kg = 'heavy'\n")), (Some(6), "link[1].mass_kg".into()));
        assert_eq!(error(&format!("{text}mass_kg = 1.0\nmas = 2.0\n")), (Some(7), "link[1].mas".into()));
        assert_eq!(error(&format!("{text}mass_kg = 1.0\ncom_mm = [1.0, 2.0]\n")), (Some(7), "link[1].com_mm".into()));
        assert_eq!(error(text), (Some(5), "link[1].mass_kg".into()));
        assert_eq!(error("name = 'x'\nlink = [{mass_kg = 1.0}, {mass_kg = true}]\n"), (Some(2), "link[1].mass_kg".into()));
        assert_eq!(error("name = 'x\nlink = []\n").0, Some(1));
    }

    #[test]
    fn the_line_of_a_key_is_found() {
        let text = "name = 'x'\n[[link]]\nmass_kg = 1.0\n\n[[link]]\nmass_kg = 2.0\n[tool.inner]\nx = [1,\n 2]\n";
        let line = |key: &str| field_error(Path::new("a"), text, key, "p", "r").line;
        assert_eq!(line("name"), Some(1));
        assert_eq!(line("link[1].mass_kg"), Some(6));
        assert_eq!(line("link[1].com_mm"), Some(5), "an absent key is reported at its table");
        assert_eq!(line("tool.inner.x[1]"), Some(9));
        assert_eq!(line("nowhere"), None);
    }
}
