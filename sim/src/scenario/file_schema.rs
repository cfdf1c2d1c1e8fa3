//! The JSON Schema of a scenario file. A file that extends another one gives any of the keys.

use schemars::Schema;
use serde_json::{Map, Value, json};

use super::ScenarioToml;

/// Where a schema keeps the tables that it refers to.
const TABLES: &str = "#/$defs/";
/// What the name of a table ends in where all of its keys may be inherited.
const INHERITING: &str = "_inheriting";

/// The schema of a scenario file.
#[must_use]
pub fn file_schema() -> Schema {
    let schema = calibench::schema::of_file::<ScenarioToml>("Scenario", &[]);
    let Value::Object(mut whole) = schema.to_value() else { return Schema::default() };
    let mut tables = match whole.remove("$defs") {
        Some(Value::Object(tables)) => tables,
        _ => Map::new(),
    };
    let mut about = Map::new();
    for key in ["$schema", "title", "description"] {
        about.extend(whole.remove_entry(key));
    }
    let mut named = Vec::new();
    let mut extending = inheriting(Value::Object(whole.clone()), &mut named);
    let extends =
        json!({"description": "A scenario file, relative to this one, whose keys hold unless given here.", "type": "string"});
    if let Some(Value::Object(properties)) = extending.get_mut("properties") {
        properties.insert("extends".into(), extends);
    }
    while let Some(name) = named.pop() {
        let copy = format!("{name}{INHERITING}");
        if let (false, Some(table)) = (tables.contains_key(&copy), tables.get(&name).cloned()) {
            let table = inheriting(table, &mut named);
            tables.insert(copy, table);
        }
    }
    about.insert("if".into(), json!({"required": ["extends"]}));
    about.insert("then".into(), extending);
    about.insert("else".into(), Value::Object(whole));
    about.insert("$defs".into(), Value::Object(tables));
    Schema::from(about)
}

/// A table without keys that must be there, and so its tables, which are `named`. Lists are inherited as a whole: their
/// entries stay as they are.
fn inheriting(schema: Value, named: &mut Vec<String>) -> Value {
    match schema {
        Value::Object(keys) => {
            let rest = keys.into_iter().filter(|(key, value)| !(key == "required" && value.is_array()));
            let changed = rest.map(|(key, value)| match (key.as_str(), &value) {
                ("items", _) => (key, value),
                ("$ref", Value::String(of)) => match of.strip_prefix(TABLES) {
                    Some(name) => {
                        named.push(name.into());
                        (key, format!("{of}{INHERITING}").into())
                    }
                    None => (key, value),
                },
                _ => (key, inheriting(value, named)),
            });
            Value::Object(changed.collect())
        }
        Value::Array(all) => Value::Array(all.into_iter().map(|one| inheriting(one, named)).collect()),
        plain => plain,
    }
}
