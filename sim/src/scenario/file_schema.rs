//! The JSON Schema of a scenario file. A file that extends another one may leave out any key of a table.

use schemars::Schema;
use serde_json::{Map, Value, json};

use super::ScenarioToml;

/// Path in a schema under which the tables that it refers to are kept.
const TABLES: &str = "#/$defs/";
/// Suffix of a table's name for the keys that are required in a file that extends no other.
const COMPLETE: &str = "_complete";

/// The schema of a scenario file.
#[must_use]
pub fn file_schema() -> Schema {
    let schema = calibench::schema::of_file::<ScenarioToml>("Scenario", &[]);
    let Value::Object(mut file) = schema.to_value() else { return Schema::default() };
    let Some(Value::Object(mut tables)) = file.remove("$defs") else { return Schema::default() };
    let complete = completed(&mut file, &mut tables);
    if let Some(Value::Object(keys)) = file.get_mut("properties") {
        let meaning = "A scenario file, relative to this one, whose keys hold unless they are given here.";
        keys.insert("extends".into(), json!({"description": meaning, "type": "string"}));
    }
    file.insert("if".into(), json!({"required": ["extends"]}));
    file.insert("else".into(), Value::Object(complete));
    file.insert("$defs".into(), Value::Object(tables));
    Schema::from(file)
}

/// Takes the required keys out of a table and of the tables in it, and returns what a complete table must have.
///
/// Lists are inherited as a whole, so that their entries stay as they are.
fn completed(table: &mut Map<String, Value>, tables: &mut Map<String, Value>) -> Map<String, Value> {
    let mut complete = Map::new();
    complete.extend(table.remove_entry("required"));
    let mut within = Map::new();
    for (key, value) in table.get("properties").and_then(Value::as_object).into_iter().flatten() {
        if let Some(of) = complete_reference(value, tables) {
            within.insert(key.clone(), of);
        } else if let Some(of) = value.get("additionalProperties").and_then(|entry| complete_reference(entry, tables)) {
            within.insert(key.clone(), json!({"additionalProperties": of}));
        }
    }
    if !within.is_empty() {
        complete.insert("properties".into(), Value::Object(within));
    }
    complete
}

/// A reference to what a table must have, if this is a reference to a table that must have anything.
fn complete_reference(schema: &Value, tables: &mut Map<String, Value>) -> Option<Value> {
    let name = schema.get("$ref")?.as_str()?.strip_prefix(TABLES)?;
    let of = format!("{name}{COMPLETE}");
    if !tables.contains_key(&of) {
        let Value::Object(mut table) = tables.get(name)?.clone() else { return None };
        let complete = completed(&mut table, tables);
        tables.insert(name.into(), Value::Object(table));
        if complete.is_empty() {
            return None;
        }
        tables.insert(of.clone(), Value::Object(complete));
    }
    Some(json!({"$ref": format!("{TABLES}{of}")}))
}
