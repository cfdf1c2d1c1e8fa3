//! `cell.toml`: a real cell, its robot and its indicators, their addresses and their limits.

mod devices;
mod keys;

use std::path::{Path, PathBuf};

use self::keys::{CellToml, CentringToml, KindToml};
use super::mastering::MasteringSettings;
use crate::cell::gauge::{CellIndicator, indicators};
use crate::cell::guards::Guards;
use crate::cell::kuka::KukaKeys;
use crate::cell::{CellReading, RobotKeys, RobotKind, RobotSettings, TriCal};
use crate::files::{FileError, parse_toml, read_text};
use crate::measure::centring::CentringSettings;
use crate::measure::dataset::Dataset;
use crate::measure::dataset::file::read_description;
use crate::robot::FramePose;
use crate::units::{MM, UM};

/// Format tag.
pub const CELL_FORMAT: &str = "calibench-cell/1";

/// A real cell.
#[derive(Debug, Clone)]
pub struct Cell {
    /// Description of the measurement: robot, base, tool, payloads, balls, noise; no samples.
    pub dataset: Dataset,
    /// A scenario of the same cell, if any: it contains the bodies among which poses are planned.
    pub scenario: Option<PathBuf>,
    /// The robot.
    pub robot: RobotSettings,
    /// Speed override during the measurement, %.
    pub speed_percent: u8,
    /// The controller's flange in the last frame of the robot's model.
    pub last_frame_from_flange: FramePose,
    /// The indicators of the tool's x, y and z axis.
    pub indicators: [CellIndicator; 3],
    /// Limits on the robot's motions.
    pub guards: Guards,
    /// The gauge and its balls.
    pub trical: TriCal,
    /// Settings of the centring.
    pub centring: CentringSettings,
    /// Settings of the mastering.
    pub mastering: MasteringSettings,
}

/// Reads a `cell.toml` and the dataset description that it names.
///
/// # Errors
/// One error that names file, line, key and remedy.
pub fn read_cell(path: &Path) -> Result<Cell, FileError> {
    let text = read_text(path)?;
    let kind: KindToml = parse_toml(path, &text)?;
    let reading = CellReading { path, text: &text };
    match kind.robot.kind {
        RobotKind::Kuka => cell::<KukaKeys>(&reading),
    }
}

/// The schema of this file.
#[cfg(feature = "schema")]
pub(crate) fn cell_schema() -> schemars::Schema {
    crate::schema::of_file::<CellToml<KukaKeys>>("Cell", &[])
}

/// Reads the cell of a file that names a robot of this kind.
fn cell<R: RobotKeys>(reading: &CellReading<'_>) -> Result<Cell, FileError> {
    let file: CellToml<R> = parse_toml(reading.path, reading.text)?;
    if file.format != CELL_FORMAT {
        let problem = format!("`{}` is not read by this version", file.format);
        return Err(reading.wrong("format", problem, &format!("write `{CELL_FORMAT}`")));
    }
    let folder = reading.path.parent().unwrap_or(Path::new(""));
    let named = folder.join(&file.dataset);
    if !named.exists() {
        let problem = format!("{} is not there", named.display());
        return Err(reading.wrong("dataset", problem, "name a dataset.toml, relative to this file"));
    }
    let dataset = read_description(&named)?;
    if let Some(joint) = dataset.robot.first_prismatic() {
        let problem = format!("its robot's joint {} is prismatic, and cells drive arms whose joints turn", joint + 1);
        return Err(reading.wrong("dataset", problem, "measure the arm by other means, and give its samples"));
    }
    let robot = file.robot.settings(reading, dataset.robot.joints())?;
    let guards = file.guards.guards(reading, (&dataset.robot, dataset.base, dataset.tool))?;
    let trical = file.trical.trical(reading)?;
    let tolerance = reading.positive("centring.tolerance_um", file.centring.tolerance_um)? * UM;
    let CentringToml { readings, max_steps, .. } = file.centring;
    let stable_within = reading.positive("mastering.stable_within_um", file.mastering.stable_within_um)? * UM;
    let placed_within = reading.positive("mastering.placed_within_mm", file.mastering.placed_within_mm)? * MM;
    Ok(Cell {
        robot,
        speed_percent: reading.percent("robot.speed_percent", file.robot.speed_percent())?,
        last_frame_from_flange: file.robot.flange().frame(),
        indicators: indicators(reading, &file.indicator)?,
        centring: CentringSettings { tolerance, readings, max_steps, max_step: guards.max_step, ..CentringSettings::default() },
        mastering: MasteringSettings { stable_within, placed_within, ..MasteringSettings::default() },
        guards,
        trical,
        dataset,
        scenario: file.scenario.map(|named| folder.join(named)),
    })
}
