//! `calibration.toml`: a calibration in mm and deg, readable by people and programs.

mod reader;
mod tables;

use std::path::Path;

use super::calibration::Calibration;
use super::error_field_file::ErrorFieldTable;
use super::own_effects::tables as own_effect_tables;
use crate::files::FileError;
use crate::files::disk::write_whole;
use crate::robot::built_in;
use crate::robot::robot_file::to_toml;

pub use reader::read_calibration;
use tables::{File, FitTable, JointRange, ParameterTable, SetupTable};

/// Format tag.
pub const FORMAT: &str = "calibench-calibration/1";

/// Writes a calibration atomically; a robot that is not built in is written beside it, as `NAME.robot.toml`.
///
/// # Errors
/// When the file cannot be written.
pub fn write_calibration(c: &Calibration, path: &Path) -> Result<(), FileError> {
    let own_robot = built_in(&c.robot_reference).is_none().then(|| own_robot_name(path));
    let file = File {
        format: FORMAT.into(),
        robot: own_robot.clone().unwrap_or_else(|| c.robot_reference.clone()),
        effects: c.model.ids(),
        measured_torques: c.model.measured_torques,
        width: c.model.width.clone(),
        dataset_sha256: c.dataset_hashes.clone(),
        fitted_rows: c.fitted_rows.to_text(),
        absolute_accuracy: c.absolute_accuracy,
        fleet_robots: c.fleet_robots,
        misfit: c.misfit.clone(),
        unresolved: c.unresolved.clone(),
        fit: FitTable::of(c),
        joint_range: c.joint_ranges.iter().enumerate().map(|(i, range)| JointRange::of(i, *range, c.robot.kind(i))).collect(),
        setup: c.setups.iter().map(SetupTable::of).collect(),
        effect: own_effect_tables(&c.model.own, &c.model.effects),
        error_field: c.model.field.as_ref().map(|field| ErrorFieldTable::of(field)),
        parameter: c.estimates.iter().map(ParameterTable::of).collect(),
        correlation: (0..c.correlation.nrows()).map(|r| (0..=r).map(|k| c.correlation[(r, k)]).collect()).collect(),
    };
    let text = toml::to_string(&file).map_err(|e| FileError::whole(path, e.to_string(), "report this as a defect"))?;
    if let Some(name) = own_robot {
        write_whole(&path.with_file_name(name), to_toml(&c.robot).as_bytes())?;
    }
    write_whole(path, text.as_bytes())
}

/// The schema of this file.
#[cfg(feature = "schema")]
pub(crate) fn calibration_schema() -> schemars::Schema {
    crate::schema::of_file::<File>("Calibration", &["joint_range"])
}

/// File name of a robot that is not built in, for the calibration at `path`.
fn own_robot_name(path: &Path) -> String {
    // The name is stored in the calibration, which is text, so it must be UTF-8.
    format!("{}.robot.toml", path.file_stem().and_then(|s| s.to_str()).unwrap_or("calibration"))
}
