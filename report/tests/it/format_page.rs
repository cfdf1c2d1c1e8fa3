//! The keys of a schema as the tables of a page.

use std::fmt::Write;

use serde_json::{Map, Value};

/// A table of the file: where it stands, how that is written, and the schema that holds its keys.
struct Table<'a> {
    name: &'a str,
    path: String,
    headings: Vec<String>,
    schema: &'a Value,
}

/// The tables of a file in Markdown, the file itself first.
pub fn keys(root: &Value) -> String {
    let mut tables = vec![Table { name: "", path: String::new(), headings: Vec::new(), schema: root }];
    let mut next = 0;
    while next < tables.len() {
        let (path, schema) = (tables[next].path.clone(), tables[next].schema);
        for (key, schema) in schema["properties"].as_object().into_iter().flatten() {
            let at = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            let (inner, heading, path) = match schema {
                list if list["items"].is_object() => (&list["items"], format!("`[[{at}]]`"), at),
                map if map["additionalProperties"].is_object() => {
                    (&map["additionalProperties"], format!("`[{at}.NAME]`"), format!("{at}.NAME"))
                }
                plain => (plain, format!("`[{at}]`"), at),
            };
            let Some(name) = inner["$ref"].as_str().and_then(|of| of.strip_prefix("#/$defs/")) else { continue };
            let schema = &root["$defs"][name];
            match tables.iter_mut().find(|table| table.name == name) {
                Some(table) => table.headings.push(heading),
                None if schema["properties"].is_object() => {
                    tables.push(Table { name, path, headings: vec![heading], schema });
                }
                None => {}
            }
        }
        next += 1;
    }
    let mut page = String::new();
    for table in &tables {
        if !table.headings.is_empty() {
            let what = table.schema["description"].as_str().unwrap_or_default();
            write!(page, "\n### {}\n\n{what}\n", table.headings.join(", ")).unwrap();
        }
        page += "\n| key | value | default | meaning |\n|---|---|---|---|\n";
        let required = |key: &str| table.schema["required"].as_array().is_some_and(|all| all.iter().any(|name| name == key));
        let patterns = table.schema["patternProperties"].as_object().into_iter().flatten();
        let patterns = patterns.map(|(pattern, schema)| (as_written(pattern), schema));
        let named =
            table.schema["properties"].as_object().into_iter().flatten().map(|(key, schema)| (format!("`{key}`"), schema));
        for (key, schema) in named.chain(patterns) {
            let default = match schema.get("default") {
                _ if required(key.trim_matches('`')) || key == "`q1_deg` ..." => "required".into(),
                Some(Value::Object(_)) | None => String::new(),
                Some(Value::Array(all)) if all.is_empty() => "none".into(),
                Some(Value::String(text)) if text.is_empty() => "none".into(),
                Some(value) => format!("`{value}`"),
            };
            let meaning = schema["description"].as_str().unwrap_or_default().replace('\n', " ").replace('|', "\\|");
            writeln!(page, "| {key} | {} | {default} | {meaning} |", value_of(schema, root)).unwrap();
        }
    }
    page
}

/// A pattern of keys by its first one.
fn as_written(pattern: &str) -> String {
    match pattern.trim_matches(['^', '$']) {
        free if free.ends_with("_.") => format!("`{}...`", free.trim_end_matches('.')),
        numbered => format!("`{}` ...", numbered.replace("[1-9][0-9]*", "1")),
    }
}

/// What stands behind a key.
fn value_of(schema: &Value, root: &Value) -> String {
    let empty = Map::new();
    let keys = schema.as_object().unwrap_or(&empty);
    if let Some(of) = keys.get("$ref").and_then(Value::as_str) {
        let named = &root["$defs"][of.trim_start_matches("#/$defs/")];
        return if named["properties"].is_object() { "table".into() } else { value_of(named, root) };
    }
    if let Some(only) = keys.get("const") {
        return format!("`{only}`");
    }
    if let Some(Value::Array(all)) = keys.get("enum") {
        return all.iter().map(|one| format!("`{one}`")).collect::<Vec<_>>().join(", ");
    }
    if let Some(Value::Array(all)) = keys.get("oneOf") {
        return all.iter().map(|one| value_of(one, root)).collect::<Vec<_>>().join(", ");
    }
    match keys.get("type").and_then(Value::as_str) {
        Some("string") => "text".into(),
        Some("integer") => "whole number".into(),
        Some("boolean") => "`true`, `false`".into(),
        Some("array") => list_of(keys, root),
        Some("object") => match keys.get("additionalProperties") {
            Some(of) if of.is_object() => format!("table of {}", several(&value_of(of, root))),
            _ => "table".into(),
        },
        Some(other) => other.into(),
        None => "any".into(),
    }
}

fn list_of(keys: &Map<String, Value>, root: &Value) -> String {
    let inner = value_of(keys.get("items").unwrap_or(&Value::Null), root);
    let count = keys.get("minItems").filter(|least| keys.get("maxItems") == Some(least)).map(Value::to_string);
    match count {
        Some(count) => format!("{count} {}", several(&inner)),
        None => format!("list of {}", several(&inner)),
    }
}

fn several(of: &str) -> String {
    match of {
        "any" => "anything".into(),
        "text" => "texts".into(),
        of if of.starts_with('`') => of.into(),
        of if of.starts_with("list of") => of.replacen("list", "lists", 1),
        of if of.starts_with(char::is_numeric) => format!("times {of}"),
        of => format!("{of}s"),
    }
}
