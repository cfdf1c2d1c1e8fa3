//! `fleet.toml`: what robots of one type have in common, without anything of a single one of them.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Fleet, FleetParameter};
use crate::files::disk::write_whole;
use crate::files::{FileError, field_error, parse_toml, read_text};
use crate::units::{Unit, readable};

/// Format tag.
const FORMAT: &str = "calibench-fleet/1";

/// Mean and spread of the parameters over robots of one type.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// Name and version of this format.
    format: String,
    /// Name of the type.
    robot: String,
    /// SHA-256 of its nominal geometry: the fleet is of no other type.
    geometry_sha256: String,
    /// Number of robots.
    robots: usize,
    /// The parameters of their arms.
    #[serde(default)]
    parameter: Vec<ParameterTable>,
}

/// A parameter of the arm.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterTable {
    /// Its name, as in a calibration.
    name: String,
    /// The effect to which it belongs.
    effect: String,
    /// Unit of all numbers of this table.
    unit: String,
    /// Mean deviation from nominal.
    mean: f64,
    /// One sigma of the next robot's deviation about it.
    sigma: f64,
    /// Standard deviation from robot to robot.
    between: f64,
    /// Plausible size of the catalogue.
    plausible: f64,
    /// Number of robots of which it was estimated.
    robots: usize,
}

/// Writes a fleet, whole or not at all.
///
/// # Errors
/// When the file cannot be written.
pub fn write_fleet(fleet: &Fleet, path: &Path) -> Result<(), FileError> {
    let table = |p: &FleetParameter| {
        let of = |number: f64| readable(number, p.unit.si);
        ParameterTable {
            name: p.name.clone(),
            effect: p.effect.clone(),
            unit: p.unit.symbol.into(),
            mean: of(p.mean),
            sigma: of(p.sigma),
            between: of(p.between),
            plausible: of(p.plausible),
            robots: p.robots,
        }
    };
    let file = File {
        format: FORMAT.into(),
        robot: fleet.robot.clone(),
        geometry_sha256: fleet.geometry.clone(),
        robots: fleet.robots,
        parameter: fleet.parameters.iter().map(table).collect(),
    };
    let text = toml::to_string(&file).map_err(|e| FileError::whole(path, e.to_string(), "report this as a defect"))?;
    write_whole(path, text.as_bytes())
}

/// Reads a fleet.
///
/// # Errors
/// The first mistake, with line, key and remedy.
pub fn read_fleet(path: &Path) -> Result<Fleet, FileError> {
    const AGAIN: &str = "make it again with `keep fleet`";
    let text = read_text(path)?;
    let file: File = parse_toml(path, &text)?;
    let wrong = |key: &str, problem: String| field_error(path, &text, key, problem, AGAIN);
    if file.format != FORMAT {
        return Err(wrong("format", format!("is '{}', not '{FORMAT}'", file.format)));
    }
    let mut parameters: Vec<FleetParameter> = Vec::with_capacity(file.parameter.len());
    for (k, p) in file.parameter.iter().enumerate() {
        let key = |field: &str| format!("parameter[{k}].{field}");
        let unit = Unit::ALL.into_iter().find(|unit| unit.symbol == p.unit);
        let unit = unit.ok_or_else(|| wrong(&key("unit"), format!("'{}' is not a unit of a parameter", p.unit)))?;
        if parameters.iter().any(|other| other.name == p.name) {
            return Err(wrong(&key("name"), format!("'{}' is there twice", p.name)));
        }
        if !p.mean.is_finite() {
            return Err(wrong(&key("mean"), format!("is {}", p.mean)));
        }
        for (field, number) in [("sigma", p.sigma), ("plausible", p.plausible)] {
            if !(number.is_finite() && number > 0.0) {
                return Err(wrong(&key(field), format!("is {number}, not a positive number")));
            }
        }
        if !(p.between.is_finite() && p.between >= 0.0) {
            return Err(wrong(&key("between"), format!("is {}, not a positive number", p.between)));
        }
        parameters.push(FleetParameter {
            name: p.name.clone(),
            effect: p.effect.clone(),
            unit,
            mean: p.mean * unit.si,
            sigma: p.sigma * unit.si,
            between: p.between * unit.si,
            plausible: p.plausible * unit.si,
            robots: p.robots,
        });
    }
    if parameters.is_empty() {
        return Err(wrong("parameter", "there is no parameter".into()));
    }
    Ok(Fleet { robot: file.robot, geometry: file.geometry_sha256, robots: file.robots, parameters })
}
