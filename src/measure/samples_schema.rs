//! The JSON Schema of a row of `samples.csv`: the columns with a value in it, by name.

use schemars::Schema;
use serde_json::{Map, Value, json};

use super::columns::{Column, KINDS, SETS};
use super::samples_header::EXTRA;

/// Number of joints of the arm whose columns are listed: no other quantity has as many.
const JOINTS: usize = 7;

/// The schema of a row.
pub(crate) fn samples_schema() -> Schema {
    // Of a quantity with one column per joint, all columns follow one pattern.
    let per_joint = Column::quantities(JOINTS).into_iter().filter(|q| q.count == JOINTS).map(|q| q.component);
    let per_joint: Vec<Vec<Column>> = per_joint.map(|component| (0..JOINTS).map(component).collect()).collect();
    let mut properties = Map::new();
    let mut patterns = Map::new();
    for column in Column::all(JOINTS) {
        match per_joint.iter().find(|columns| columns.contains(&column)) {
            None => drop(properties.insert(column.name(), value_of(column))),
            Some(columns) if columns[0] == column => {
                drop(patterns.insert(format!("^{}$", column.name().replacen('1', "[1-9][0-9]*", 1)), value_of(column)));
            }
            Some(_) => {}
        }
    }
    patterns.insert(format!("^{EXTRA}."), json!({"description": "A free column, kept and carried through."}));
    let mut fellows = Map::new();
    for quantity in Column::quantities(JOINTS) {
        let all: Vec<String> = (0..quantity.count).map(|k| (quantity.component)(k).name()).collect();
        // How many joints the arm has is not in this file.
        let all = if quantity.count == JOINTS { &all[..1] } else { &all[..] };
        for name in all.iter().filter(|_| all.len() > 1) {
            let others: Vec<&String> = all.iter().filter(|other| *other != name).collect();
            fellows.insert(name.clone(), json!(others));
        }
    }
    let kinds: Vec<Value> = KINDS
        .iter()
        .map(|kind| {
            let stray = KINDS.iter().flat_map(|other| other.columns()).filter(|column| kind.columns().all(|c| c != *column));
            let stray: Map<String, Value> = stray.map(|column| (column.name(), false.into())).collect();
            let required: Vec<String> = kind.required.iter().map(|column| column.name()).collect();
            json!({
                "if": {"properties": {"kind": {"const": kind.name}}},
                "then": {"required": required, "properties": stray},
            })
        })
        .collect();
    let required = [Column::Id, Column::Kind, Column::Joint(0)].map(Column::name);
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Sample",
        "description": "A row of samples.csv: its values by the names of their columns. An empty field is left out.",
        "type": "object",
        "required": required,
        "properties": properties,
        "patternProperties": patterns,
        "additionalProperties": false,
        "dependentRequired": fellows,
        "allOf": kinds,
    });
    Schema::try_from(schema).unwrap_or_default()
}

/// What a field of this column holds.
fn value_of(column: Column) -> Value {
    let description = column.meaning();
    match column {
        Column::Kind => json!({"description": description, "enum": KINDS.map(|kind| kind.name)}),
        Column::Set => json!({"description": description, "enum": SETS}),
        Column::Approach(_) => json!({"description": description, "enum": [-1, 0, 1]}),
        Column::Plunger(_) => json!({"description": description, "enum": [-1, 1]}),
        Column::Distance | Column::Sigma => json!({"description": description, "type": "number", "exclusiveMinimum": 0}),
        _ if column.is_number() => json!({"description": description, "type": "number"}),
        _ => json!({"description": description, "type": "string"}),
    }
}
