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
            let Some(name) = named(inner) else { continue };
            let kinds: Vec<&str> = root["$defs"][name]["anyOf"].as_array().into_iter().flatten().filter_map(named).collect();
            for name in if kinds.is_empty() { vec![name] } else { kinds } {
                let schema = &root["$defs"][name];
                let heading = match &schema["properties"]["kind"]["const"] {
                    Value::String(kind) => format!("{heading} with `kind = \"{kind}\"`"),
                    _ => heading.clone(),
                };
                match tables.iter_mut().find(|table| table.name == name) {
                    Some(table) if table.headings.contains(&heading) => {}
                    Some(table) => table.headings.push(heading),
                    None if schema["properties"].is_object() => {
                        tables.push(Table { name, path: path.clone(), headings: vec![heading], schema });
                    }
                    None => {}
                }
            }
        }
        next += 1;
    }
    let mut page = String::new();
    for table in &tables {
        if !table.headings.is_empty() {
            write!(page, "\n### {}\n", table.headings.join(", ")).unwrap();
        }
        if let (false, Some(what)) = (table.headings.is_empty(), table.schema["description"].as_str()) {
            write!(page, "\n{what}\n").unwrap();
        }
        page += "\n| key | value | default | meaning |\n|---|---|---|---|\n";
        let mut rows = rows(table.schema, root);
        rows.sort_by_key(|[_, _, default, _]| default != REQUIRED);
        for row in rows {
            writeln!(page, "| {} |", row.join(" | ")).unwrap();
        }
    }
    page
}

/// The name of the schema that this one refers to.
fn named(schema: &Value) -> Option<&str> {
    schema["$ref"].as_str()?.strip_prefix("#/$defs/")
}

/// Entry for a key without a default.
const REQUIRED: &str = "required";

/// The keys of a table: how they are written, their values, their defaults, their meanings.
fn rows(table: &Value, root: &Value) -> Vec<[String; 4]> {
    // Of numbered keys the first one may be required: it is named in full.
    let required = |key: &str| table["required"].as_array().is_some_and(|all| all.iter().any(|name| name == key));
    let named = table["properties"].as_object().into_iter().flatten();
    let named = named.map(|(key, schema)| (format!("`{key}`"), required(key), schema));
    let patterns = table["patternProperties"].as_object().into_iter().flatten().map(|(pattern, schema)| {
        let first = pattern.trim_matches(['^', '$']).replace("[1-9][0-9]*", "1");
        let written = match first.strip_suffix("_.") {
            Some(free) => format!("`{free}_...`"),
            None => format!("`{first}` ..."),
        };
        (written, required(&first), schema)
    });
    let row = |(key, required, schema): (String, bool, &Value)| {
        let default = match schema.get("default") {
            _ if required => REQUIRED.into(),
            Some(Value::Object(_)) | None => String::new(),
            Some(Value::Array(all)) if all.is_empty() => "none".into(),
            Some(Value::String(text)) if text.is_empty() => "none".into(),
            Some(value) => format!("`{value}`"),
        };
        let meaning = schema["description"].as_str().unwrap_or_default().replace('\n', " ").replace('|', "\\|");
        [key, value_of(schema, root), default, meaning]
    };
    named.chain(patterns).map(row).collect()
}

/// Description of the value of a key.
fn value_of(schema: &Value, root: &Value) -> String {
    let empty = Map::new();
    let keys = schema.as_object().unwrap_or(&empty);
    if let Some(only) = keys.get("const") {
        return format!("`{only}`");
    }
    if let Some(of) = keys.get("$ref").and_then(Value::as_str) {
        let named = &root["$defs"][of.trim_start_matches("#/$defs/")];
        return if named["properties"].is_object() || named["anyOf"].is_array() {
            "table".into()
        } else {
            value_of(named, root)
        };
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
            Some(of) if of.is_object() => match value_of(of, root) {
                list if list.starts_with(char::is_numeric) => format!("table of {list} each"),
                one => format!("table of {}", several(&one)),
            },
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
