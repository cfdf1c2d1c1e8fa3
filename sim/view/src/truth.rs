//! True postures of a simulated arm, from `true_arm.csv`; a real cell has no such file.

use std::path::Path;

use calibench::files::FileError;
use calibench::files::csv_table::{CsvRow, CsvTable};
use calibench::robot::Pose;
use calibench::units::{DEG, MM};
use nalgebra::{Rotation3, Translation3, Vector3};

use crate::at_rest::Arm;

/// Remedy for a damaged file.
const REMEDY: &str = "give the file as `calibench run` wrote it, or remove it";

/// Reads the true postures of an arm with this number of joints, one for each of this number of rows of `iterations.csv`;
/// `None` if the folder has none.
///
/// # Errors
/// When the file is wrong, or does not match `iterations.csv`.
pub fn read(folder: &Path, joints: usize, stops: usize) -> Result<Option<Vec<Arm>>, FileError> {
    let path = folder.join("true_arm.csv");
    if !path.is_file() {
        return Ok(None);
    }
    let columns = ["stop", "frame", "x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"];
    let table = CsvTable::read(&path, &columns, REMEDY)?;
    let rows: Vec<CsvRow<'_>> = table.rows().collect();
    let frames: Vec<String> = (0..=joints).map(|k| k.to_string()).chain(["tool".into()]).collect();
    if rows.len() != stops * frames.len() {
        let problem = format!("has {} rows, not {} for each of the {stops} of iterations.csv", rows.len(), frames.len());
        return Err(FileError::whole(&path, problem, REMEDY));
    }
    let arm = |(stop, rows): (usize, &[CsvRow<'_>])| {
        let posed = rows.iter().zip(&frames).map(|(row, frame)| pose(row, stop + 1, frame));
        let mut frames = posed.collect::<Result<Vec<Pose>, FileError>>()?;
        let tool = frames.pop().unwrap_or_default();
        Ok(Arm { frames, tool })
    };
    rows.chunks(frames.len()).enumerate().map(arm).collect::<Result<_, _>>().map(Some)
}

fn pose(row: &CsvRow<'_>, stop: usize, frame: &str) -> Result<Pose, FileError> {
    for (column, wanted) in [("stop", stop.to_string().as_str()), ("frame", frame)] {
        if row.text(column) != wanted {
            return Err(row.wrong(column, format!("'{}' stands where {wanted} is expected", row.text(column))));
        }
    }
    let three = |columns: [&str; 3]| row.three(columns)?.ok_or_else(|| row.wrong(columns[0], "a number is missing".into()));
    let at = Vector3::from(three(["x_mm", "y_mm", "z_mm"])?) * MM;
    let turned = Vector3::from(three(["rx_deg", "ry_deg", "rz_deg"])?) * DEG;
    Ok(Pose::from_parts(Translation3::from(at), Rotation3::new(turned)))
}
