//! `docs/symbols.md` has every effect of the catalogue with its equation, and with the unit of each of its parameters.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

#[test]
fn every_effect_stands_with_its_equation_and_its_units() {
    let output = Command::new(env!("CARGO_BIN_EXE_calibench")).args(["effects", "--json"]).output().unwrap();
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/symbols.md")).unwrap();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let mut rows: Vec<&str> =
        page.lines().skip_while(|line| *line != "## The effects").filter(|l| l.starts_with("| `")).collect();
    for effect in document["effects"].as_array().unwrap() {
        let (id, arguments, equation) = (text(&effect["id"]), text(&effect["arguments"]), text(&effect["equation"]));
        let start = format!("| `{id}{arguments}` | `{equation}` | ");
        let place = rows.iter().position(|row| row.starts_with(&start)).unwrap_or_else(|| panic!("no row `{start}`"));
        let units = rows.remove(place).trim_end_matches(" |").rsplit(" | ").next().unwrap();
        for parameter in effect["parameters"].as_array().unwrap() {
            let unit = text(&parameter["unit"]);
            assert!(units.split(", ").any(|u| u == unit), "{id}: {} is in {unit}, not in {units}", parameter["name"]);
        }
    }
    assert!(rows.is_empty(), "no effect of the catalogue: {rows:#?}");
}
