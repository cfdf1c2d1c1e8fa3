//! JSON Schemas of TOML files, derived from the types that read them.
//!
//! Only with the feature `schema`.

use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema};
use serde_json::Value;

/// The schema of a TOML file that `T` reads. Keys that the type leaves out, but the reader then asks for, are also `required`.
#[must_use]
pub fn of_file<T: JsonSchema>(title: &str, required: &[&str]) -> Schema {
    let mut schema = SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<T>();
    RecursiveTransform(as_in_toml).transform(&mut schema);
    schema.insert("title".into(), title.into());
    if let Value::Array(keys) = schema.ensure_object().entry("required").or_insert_with(|| Value::Array(Vec::new())) {
        keys.extend(required.iter().map(|key| Value::from(*key)));
    }
    if let Some(Value::Object(keys)) = schema.get_mut("properties") {
        for key in
            keys.iter_mut().filter(|(name, _)| required.contains(&name.as_str())).filter_map(|(_, key)| key.as_object_mut())
        {
            key.remove("default");
        }
    }
    schema
}

/// A minimum and a maximum in one unit, and none in the other.
pub(crate) fn of_unit(unit: &str, other: &str) -> Value {
    let ends = |unit: &str| ["min", "max"].map(|end| format!("{end}_{unit}"));
    let none: serde_json::Map<String, Value> = ends(other).into_iter().map(|key| (key, Value::Bool(false))).collect();
    serde_json::json!({"required": ends(unit), "properties": none})
}

/// A minimum and a maximum, either of an angle or of a length.
pub(crate) fn in_one_unit() -> [Value; 2] {
    [of_unit("deg", "mm"), of_unit("mm", "deg")]
}

/// TOML has no null: what is optional is left out. And what a writer leaves out where it is empty is empty by default.
fn as_in_toml(schema: &mut Schema) {
    let Some(keys) = schema.as_object_mut() else { return };
    let required = keys.get("required").and_then(Value::as_array).cloned().unwrap_or_default();
    for (name, key) in keys.get_mut("properties").and_then(Value::as_object_mut).into_iter().flatten() {
        let empty = match key.get("type").and_then(Value::as_str) {
            Some("boolean") => Value::from(false),
            Some("array") => Value::Array(Vec::new()),
            _ => continue,
        };
        if let (false, Some(key)) = (required.contains(&name.as_str().into()), key.as_object_mut()) {
            key.entry("default").or_insert(empty);
        }
    }
    if let Some(Value::Array(types)) = keys.get_mut("type") {
        types.retain(|name| name != "null");
        if let [only] = types.as_slice() {
            let only = only.clone();
            keys.insert("type".into(), only);
        }
    }
    if let Some(Value::Array(choices)) = keys.get_mut("anyOf") {
        choices.retain(|choice| choice.get("type").is_none_or(|name| name != "null"));
        if let [Value::Object(only)] = choices.as_mut_slice() {
            let only = std::mem::take(only);
            keys.remove("anyOf");
            keys.extend(only);
        }
    }
    if keys.get("default").is_some_and(Value::is_null) {
        keys.remove("default");
    }
}
