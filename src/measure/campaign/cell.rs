//! `cell.toml`: a real cell, its robot and its indicators, their addresses and their limits.

mod devices;
mod keys;

use std::path::{Path, PathBuf};

use self::keys::{CellToml, CentringToml, KindToml, SurroundingsToml};
use super::mastering::MasteringSettings;
use crate::cell::gauge::{CellIndicator, indicators};
use crate::cell::guards::Guards;
use crate::cell::kuka::KukaKeys;
use crate::cell::ur::UrKeys;
use crate::cell::{CellReading, RobotKeys, RobotKind, RobotSettings, TriCal};
use crate::files::{FileError, parse_toml, read_text};
use crate::measure::centring::CentringSettings;
use crate::measure::dataset::Dataset;
use crate::measure::dataset::file::read_description;
use crate::robot::FramePose;
use crate::robot::solids::{Solid, Surroundings};
use crate::units::{MM, UM};

/// Format tag.
pub const CELL_FORMAT: &str = "calibench-cell/1";

/// A real cell.
#[derive(Debug, Clone)]
pub struct Cell {
    /// The file that describes it.
    pub file: PathBuf,
    /// Description of the measurement: robot, base, tool, payloads, balls, noise; no samples.
    pub dataset: Dataset,
    /// A scenario of the same cell, if any: it contains the settings with which poses are planned.
    pub scenario: Option<PathBuf>,
    /// The bodies around the arm, balls included; `None` if the file does not name them.
    pub surroundings: Option<Surroundings>,
    /// The robot.
    pub robot: RobotSettings,
    /// Speed override during the measurement, %.
    pub speed_percent: u8,
    /// The controller's flange in the last frame of the robot's model.
    pub last_frame_from_flange: FramePose,
    /// The indicators of the tool's x, y and z axis; `None` of a cell that measures points.
    pub indicators: Option<[CellIndicator; 3]>,
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
    match kind.robot.kind.unwrap_or_default() {
        RobotKind::Kuka => cell::<KukaKeys>(&reading).map_err(|error| {
            // A key that another make knows is no key too many.
            let text = text.replacen("[robot]", "[robot]\nkind = \"ur\"", 1);
            let is_of_ur = kind.robot.kind.is_none() && cell::<UrKeys>(&CellReading { path, text: &text }).is_ok();
            let problem = "has the keys of a Universal Robot and no `kind`";
            if is_of_ur { reading.wrong("robot", problem, "add `kind = \"ur\"`") } else { error }
        }),
        RobotKind::Ur => cell::<UrKeys>(&reading),
    }
}

/// The keys of `[robot]`, of any kind.
#[cfg(feature = "schema")]
#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
#[allow(dead_code)] // only its schema is used
enum AnyRobot {
    /// A KUKA robot.
    Kuka(Box<KukaKeys>),
    /// A Universal Robot.
    Ur(Box<UrKeys>),
}

/// The schema of this file.
#[cfg(feature = "schema")]
pub(crate) fn cell_schema() -> schemars::Schema {
    crate::schema::of_file::<CellToml<AnyRobot>>("Cell", &[])
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
    let trical = file.trical.trical(reading)?;
    let surroundings =
        file.surroundings.map(|named| surroundings(reading, &named, &dataset, trical.datum_radius)).transpose()?;
    let robot = file.robot.settings(reading, dataset.robot.joints())?;
    let guards = file.guards.guards(reading, &dataset.robot, dataset.base, dataset.tool)?;
    let tolerance = reading.positive("centring.tolerance_um", file.centring.tolerance_um)? * UM;
    let CentringToml { readings, max_steps, .. } = file.centring;
    let stable_within = reading.positive("mastering.stable_within_um", file.mastering.stable_within_um)? * UM;
    let placed_within = reading.positive("mastering.placed_within_mm", file.mastering.placed_within_mm)? * MM;
    Ok(Cell {
        file: reading.path.to_owned(),
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
        surroundings,
    })
}

/// The bodies of the scene file, and after them the balls, of this radius (m).
fn surroundings(
    reading: &CellReading<'_>,
    named: &SurroundingsToml,
    dataset: &Dataset,
    radius: f64,
) -> Result<Surroundings, FileError> {
    let scene = reading.path.parent().unwrap_or(Path::new("")).join(&named.scene);
    if !scene.exists() {
        let problem = format!("{} is not there", scene.display());
        return Err(reading.wrong("surroundings.scene", problem, "name a scene.toml, relative to this file"));
    }
    let mut bodies = Surroundings::read(&scene)?;
    let balls: Vec<Solid> = dataset.balls.iter().map(|ball| Solid::ball(&ball.id, ball.position, radius)).collect();
    if let Some(twice) = bodies.fixed.iter().find(|body| balls.iter().any(|ball| ball.name == body.name)) {
        let problem = format!("{} holds a body '{}', which is a ball of the dataset", scene.display(), twice.name);
        return Err(reading.wrong("surroundings.scene", problem, "leave the balls out of the scene"));
    }
    bodies.fixed.extend(balls);
    Ok(bodies)
}
