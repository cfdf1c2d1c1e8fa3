//! TOML documents whose errors have a location: line, key path, remedy.

use std::ops::Range;
use std::path::Path;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::error::FileError;
use super::names::name_remedy;

/// Reads a TOML document into `T`.
///
/// Non-finite numbers are rejected everywhere.
///
/// ```
/// use std::collections::BTreeMap;
/// use std::path::Path;
///
/// use calibench::files::parse_toml;
///
/// let ball = Path::new("ball.toml");
/// let numbers: BTreeMap<String, f64> = parse_toml(ball, "x_mm = 250.0\n")?;
/// assert_eq!(numbers["x_mm"], 250.0);
/// let wrong = parse_toml::<BTreeMap<String, f64>>(ball, "x_mm = 250.0\ny_mm = nan\n");
/// assert!(wrong.is_err_and(|e| (e.line, e.field.as_str()) == (Some(2), "y_mm")));
/// # Ok::<(), calibench::files::FileError>(())
/// ```
///
/// # Errors
/// The first error, with its line and its key path (`ball[2].x_mm`, elements counted from 0): bad syntax, an unknown or a
/// missing key, a value of the wrong kind, NaN or infinity.
pub fn parse_toml<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, FileError> {
    let document = DeTable::parse(text).map_err(|e| toml_error(path, text, &e, None))?;
    let table = document.get_ref();
    let mut not_finite = None;
    walk(table, "", &mut |key, _, value, span| {
        if let DeValue::Float(number) = value
            && !number.as_str().replace('_', "").parse::<f64>().is_ok_and(f64::is_finite)
            && not_finite.is_none()
        {
            not_finite = Some((key.to_owned(), span));
        }
    });
    if let Some((field, span)) = not_finite {
        let problem = format!("`{}` is not a finite number", &text[span.clone()]);
        return Err(FileError {
            line: Some(line_of(text, span.start)),
            field,
            ..FileError::whole(path, problem, "give a finite number")
        });
    }
    toml::from_str(text).map_err(|e| toml_error(path, text, &e, Some(table)))
}

/// Creates an error at a key of a TOML document, or at the nearest existing table above it.
///
/// `key_path` is written as `ball[2].x_mm`, elements counted from 0.
///
/// ```
/// use std::path::Path;
///
/// use calibench::files::field_error;
///
/// let text = "[[ball]]\nid = 'A'\nx_mm = 1e9\n";
/// let error = field_error(Path::new("cell.toml"), text, "ball[0].x_mm", "is out of range", "give it in mm");
/// assert_eq!(error.to_string(), "cell.toml:3: ball[0].x_mm: is out of range; give it in mm");
/// ```
pub fn field_error(
    path: &Path,
    text: &str,
    key_path: &str,
    problem: impl Into<String>,
    remedy: impl Into<String>,
) -> FileError {
    let mut best: Option<(usize, usize)> = None;
    if let Ok(document) = DeTable::parse(text) {
        walk(document.get_ref(), "", &mut |key, key_span, _, _| {
            let leads = key_path.strip_prefix(key).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']));
            if leads && best.is_none_or(|(length, _)| key.len() >= length) {
                best = Some((key.len(), line_of(text, key_span.start)));
            }
        });
    }
    FileError { line: best.map(|(_, line)| line), field: key_path.into(), ..FileError::whole(path, problem, remedy) }
}

/// Line of a byte, counted from 1.
fn line_of(text: &str, byte: usize) -> usize {
    1 + text.as_bytes().iter().take(byte).filter(|&&b| b == b'\n').count()
}

/// Visitor, called with the key path, the span of the key, the value, and the span of the value.
type Visit<'v, 'a> = dyn FnMut(&str, Range<usize>, &DeValue<'a>, Range<usize>) + 'v;

/// Calls `visit(key path, span of the key, value, span of the value)` for everything in a table, parents first.
fn walk<'a>(table: &DeTable<'a>, above: &str, visit: &mut Visit<'_, 'a>) {
    for (key, value) in table {
        let path = if above.is_empty() { key.get_ref().to_string() } else { format!("{above}.{}", key.get_ref()) };
        walk_value(&path, key.span(), value.get_ref(), value.span(), visit);
    }
}

fn walk_value<'a>(path: &str, key_span: Range<usize>, value: &DeValue<'a>, span: Range<usize>, visit: &mut Visit<'_, 'a>) {
    visit(path, key_span, value, span);
    match value {
        DeValue::Table(table) => walk(table, path, visit),
        DeValue::Array(elements) => {
            for (k, element) in elements.iter().enumerate() {
                walk_value(&format!("{path}[{k}]"), element.span(), element.get_ref(), element.span(), visit);
            }
        }
        _ => {}
    }
}

/// Converts an error of the TOML reader.
fn toml_error(path: &Path, text: &str, error: &toml::de::Error, table: Option<&DeTable<'_>>) -> FileError {
    // The whole document has an empty span: a key missing from it has no line.
    let start = error.span().filter(|span| table.is_none() || !span.is_empty()).map(|span| span.start.min(text.len()));
    let mut field = String::new();
    if let (Some(start), Some(table)) = (start, table) {
        let mut narrowest = usize::MAX;
        walk(table, "", &mut |key, key_span, _, span| {
            for s in [key_span, span] {
                if s.contains(&start) && s.len() <= narrowest {
                    narrowest = s.len();
                    field = key.to_owned();
                }
            }
        });
    }
    let quoted: Vec<&str> = error.message().split('`').skip(1).step_by(2).collect();
    let name = quoted.first().copied().unwrap_or_default();
    let message = error.message();
    let (problem, remedy) = if message.starts_with("unknown field") {
        ("there is no such key".to_owned(), name_remedy(name, quoted.get(1..).unwrap_or_default()))
    } else if message.starts_with("missing field") {
        field = if field.is_empty() { name.to_owned() } else { format!("{field}.{name}") };
        ("is missing".to_owned(), format!("add `{name}`"))
    } else if message.starts_with("unknown variant") {
        (format!("`{name}` is not known"), name_remedy(name, quoted.get(1..).unwrap_or_default()))
    } else if message.starts_with("invalid type") || message.starts_with("invalid value") {
        let expected = message.rsplit_once("expected ").map_or("another kind of value", |(_, e)| e);
        let expected = match expected {
            "f64" => "a number",
            "usize" | "u64" | "u32" | "u16" | "u8" => "a whole number, not negative",
            "i64" | "i32" => "a whole number",
            "any valid TOML value" => "a whole number below 2^63",
            table if table.starts_with("struct ") => "a table",
            other => other,
        };
        (message.to_owned(), format!("give {expected}"))
    } else if message.starts_with("invalid length") {
        (message.to_owned(), "give that many elements".into())
    } else if message == "duplicate key" {
        (message.to_owned(), "keep one of them".into())
    } else if table.is_none() {
        (message.to_owned(), "correct the TOML here (strings in quotes, decimal points, one `key = value` a line)".into())
    } else {
        (message.to_owned(), "correct this value".into())
    };
    FileError { line: start.map(|s| line_of(text, s)), field, ..FileError::whole(path, problem, remedy) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Table {
        base: Row,
        #[serde(default)]
        ball: Vec<Row>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct Row {
        x_mm: f64,
        com_mm: Option<[f64; 3]>,
    }

    fn error(text: &str) -> FileError {
        parse_toml::<Table>(Path::new("f.toml"), text).expect_err("every case here is wrong")
    }

    #[test]
    fn mistakes_are_placed() {
        let ball = "[base]\nx_mm = 1\n[[ball]]\nx_mm = 1.0\n[[ball]]\n";
        for (text, line, field, remedy) in [
            (format!("{ball}x = 3"), Some(6), "ball[1].x", "the unit is part of the name"),
            (format!("{ball}x_m = 3"), Some(6), "ball[1].x_m", "as `x_mm`, in that unit"),
            (format!("{ball}x_mm = nan"), Some(6), "ball[1].x_mm", "finite"),
            (format!("{ball}x_mm = -inf"), Some(6), "ball[1].x_mm", "finite"),
            (format!("{ball}x_mm = 1e999"), Some(6), "ball[1].x_mm", "finite"),
            (format!("{ball}com_mm = [1, 2, 3]"), Some(5), "ball[1].x_mm", "add `x_mm`"),
            (format!("{ball}x_mm = \"1\""), Some(6), "ball[1].x_mm", "a number"),
            (format!("{ball}x_mm = 1\ncom_mm = [1, 2]"), Some(7), "ball[1].com_mm", "that many"),
            (format!("{ball}x_mm = 1\ncom_mm = [1, nan, 3]"), Some(7), "ball[1].com_mm[1]", "finite"),
            ("ball = []".into(), None, "base", "add `base`"),
            ("[base]\nx_mm = 1,5".into(), Some(2), "", "decimal points"),
            ("[base]\nx_mm = 1\nx_mm = 2".into(), Some(3), "", "keep one"),
        ] {
            let e = error(&text);
            assert_eq!((e.line, e.field.as_str()), (line, field), "{text}\n{e}");
            assert!(e.remedy.contains(remedy), "{text}\n{e}");
        }
    }

    #[test]
    fn a_field_is_found_by_its_path() {
        let text = "[base]\nx_mm = 1\n[[ball]]\nx_mm = 1.0\n\n[[ball]]\nx_mm = 2\ncom_mm = [1,\n2,\n3]\n";
        for (key, line) in [
            ("base", 1),
            ("base.x_mm", 2),
            ("ball[1]", 6),
            ("ball[1].x_mm", 7),
            ("ball[1].com_mm[2]", 10),
            ("ball[1].sigma_um", 6),
            ("ball[7]", 3),
        ] {
            assert_eq!(field_error(Path::new("f"), text, key, "p", "r").line, Some(line), "{key}");
        }
        assert_eq!(field_error(Path::new("f"), text, "noise.ball_um", "p", "r").line, None);
    }

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

    fn place(text: &str) -> (Option<usize>, String) {
        let e = parse_toml::<Arm>(Path::new("arm.toml"), text).unwrap_err();
        assert!(!e.problem.is_empty() && !e.remedy.is_empty());
        (e.line, e.field)
    }

    #[test]
    fn a_wrong_key_is_named_with_its_line() {
        let text = "name = 'x'\n[[link]]\nmass_kg = 1.0\n\n[[link]]\n";
        assert_eq!(place(&format!("{text}mass_kg = 'heavy'\n")), (Some(6), "link[1].mass_kg".into()));
        assert_eq!(place(&format!("{text}mass_kg = 1.0\nmas = 2.0\n")), (Some(7), "link[1].mas".into()));
        assert_eq!(place(&format!("{text}mass_kg = 1.0\ncom_mm = [1.0, 2.0]\n")), (Some(7), "link[1].com_mm".into()));
        assert_eq!(place(text), (Some(5), "link[1].mass_kg".into()));
        assert_eq!(place("name = 'x'\nlink = [{mass_kg = 1.0}, {mass_kg = true}]\n"), (Some(2), "link[1].mass_kg".into()));
        assert_eq!(place("name = 'x\nlink = []\n").0, Some(1));
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
