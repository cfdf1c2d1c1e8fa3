//! The JSON Schema of a row of `samples.csv`: the columns with a value in it, by name.

use schemars::Schema;
use serde_json::{Map, Value, json};

use super::columns::{Column, KINDS, SETS};
use super::samples_header::EXTRA;
use crate::robot::{JointKind, Robot, built_in};

/// The arm whose columns are listed: no other quantity has as many as it has joints.
const ARM: &str = "panda";

/// That arm with joints of one kind.
fn arm(kind: JointKind) -> Robot {
    let mut robot = built_in(ARM).unwrap_or_default();
    robot.links.iter_mut().for_each(|link| link.mdh.kind = kind);
    robot
}

/// The schema of a row.
pub(crate) fn samples_schema() -> Schema {
    let arms = [JointKind::Revolute, JointKind::Prismatic].map(arm);
    let joints = arms[0].joints();
    // Of a quantity with one column per joint, all columns follow one pattern.
    let quantities = || arms.iter().flat_map(Column::quantities);
    let per_joint: Vec<Vec<Column>> = quantities().filter(|columns| columns.len() == joints).collect();
    let mut properties = Map::new();
    let mut patterns = Map::new();
    for column in arms.iter().flat_map(Column::all) {
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
    for quantity in quantities() {
        let all: Vec<String> = quantity.iter().map(|column| column.name()).collect();
        // How many joints the arm has is not in this file.
        let all = if quantity.len() == joints { &all[..1] } else { &all[..] };
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
    let required = [Column::Id, Column::Kind].map(Column::name);
    let first = [Column::Joint(0), Column::Slide(0)].map(|joint| json!({"required": [joint.name()]}));
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
        "oneOf": first,
        "allOf": kinds,
    });
    Schema::try_from(schema).unwrap_or_default()
}

/// Schema of a field of this column.
fn value_of(column: Column) -> Value {
    let description = column.meaning();
    match column {
        Column::Kind => json!({"description": description, "enum": KINDS.map(|kind| kind.name)}),
        Column::Set => json!({"description": description, "enum": SETS}),
        Column::Approach(_) => json!({"description": description, "enum": [-1, 0, 1]}),
        Column::Plunger(_) => json!({"description": description, "enum": [-1, 1]}),
        Column::Distance | Column::Sigma | Column::SigmaOrientation => {
            json!({"description": description, "type": "number", "exclusiveMinimum": 0})
        }
        _ if column.is_number() => json!({"description": description, "type": "number"}),
        _ => json!({"description": description, "type": "string"}),
    }
}
