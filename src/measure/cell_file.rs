//! `cell.toml`: a real cell, its robot and its indicators, where they are found and what they may do.

use std::path::{Path, PathBuf};
use std::time::Duration;

use nalgebra::Vector3;

use super::cell_toml::{CellToml, CentringToml, GuardsToml, IndicatorToml, LONGEST_STEP, RobotToml, TriCalToml};
use super::{CentringSettings, Dataset, MasteringSettings, read_description};
use crate::cell::gauge::{Dialect, IndicatorSettings, LineSettings};
use crate::cell::kuka::{KukaSettings, Patience};
use crate::cell::{Guards, TriCal};
use crate::files::{FileError, field_error, name_remedy, parse_toml, read_text};
use crate::robot::FramePose;
use crate::units::{DEG, MM, UM};

/// Format tag.
pub const CELL_FORMAT: &str = "calibench-cell/1";

/// A real cell.
#[derive(Debug, Clone)]
pub struct Cell {
    /// What is measured with what: robot, base, tool, payloads, balls, noise; no samples.
    pub dataset: Dataset,
    /// A scenario of the same cell, where there is one: it knows the bodies among which poses are planned.
    pub scenario: Option<PathBuf>,
    /// The robot.
    pub robot: KukaSettings,
    /// Speed override during the measurement, %.
    pub speed_percent: u8,
    /// The controller's flange in the last frame of the robot's model.
    pub last_frame_from_flange: FramePose,
    /// The indicators of the tool's x, y and z axis.
    pub indicators: [CellIndicator; 3],
    /// What the robot may do.
    pub guards: Guards,
    /// The gauge and its balls.
    pub trical: TriCal,
    /// How balls are centred.
    pub centring: CentringSettings,
    /// How the gauge is mastered.
    pub mastering: MasteringSettings,
}

/// Where an indicator is found, and how it is spoken to.
#[derive(Debug, Clone, PartialEq)]
pub struct CellIndicator {
    /// Where.
    pub place: Place,
    /// How.
    pub settings: IndicatorSettings,
}

/// Where an indicator is found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// A serial port with these settings.
    Serial(String, LineSettings),
    /// A socket, `HOST:PORT`.
    Socket(String),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Serial(place, _) | Place::Socket(place) => f.write_str(place),
        }
    }
}

/// Reads a `cell.toml` and the description of the dataset that it names.
///
/// # Errors
/// One error that names file, line, key and remedy.
pub fn read_cell(path: &Path) -> Result<Cell, FileError> {
    let text = read_text(path)?;
    let reading = Reading { path, text: &text };
    let file: CellToml = parse_toml(path, &text)?;
    if file.format != CELL_FORMAT {
        let problem = format!("`{}` is not read by this version", file.format);
        return Err(reading.wrong("format", problem, &format!("write `{CELL_FORMAT}`")));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let named = folder.join(&file.dataset);
    if !named.exists() {
        let problem = format!("{} is not there", named.display());
        return Err(reading.wrong("dataset", problem, "name a dataset.toml, relative to this file"));
    }
    let dataset = read_description(&named)?;
    if dataset.robot.joints() > 6 {
        let problem = format!("its robot has {} joints", dataset.robot.joints());
        return Err(reading.wrong("dataset", problem, "a KUKA controller moves six; give the model of such an arm"));
    }
    let robot = reading.robot(&file.robot, dataset.robot.joints())?;
    let guards = reading.guards(&file.guards, &dataset)?;
    let trical = reading.trical(&file.trical)?;
    let tolerance = reading.positive("centring.tolerance_um", file.centring.tolerance_um)? * UM;
    let CentringToml { readings, max_steps, .. } = file.centring;
    let stable_within = reading.positive("mastering.stable_within_um", file.mastering.stable_within_um)? * UM;
    let placed_within = reading.positive("mastering.placed_within_mm", file.mastering.placed_within_mm)? * MM;
    let f = &file.robot.flange;
    Ok(Cell {
        robot,
        speed_percent: reading.percent("robot.speed_percent", file.robot.speed_percent)?,
        last_frame_from_flange: FramePose {
            xyz: [f.x_mm * MM, f.y_mm * MM, f.z_mm * MM],
            rz_ry_rx: [f.a_deg * DEG, f.b_deg * DEG, f.c_deg * DEG],
        },
        indicators: reading.indicators(&file.indicator)?,
        centring: CentringSettings { tolerance, readings, max_steps, max_step: guards.max_step, ..CentringSettings::default() },
        mastering: MasteringSettings { stable_within, placed_within, ..MasteringSettings::default() },
        guards,
        trical,
        dataset,
        scenario: file.scenario.map(|named| folder.join(named)),
    })
}

struct Reading<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Reading<'_> {
    fn wrong(&self, key: &str, problem: impl Into<String>, remedy: &str) -> FileError {
        field_error(self.path, self.text, key, problem, remedy)
    }

    fn positive(&self, key: &str, value: f64) -> Result<f64, FileError> {
        if value > 0.0 { Ok(value) } else { Err(self.wrong(key, format!("{value} is not positive"), "give a positive number")) }
    }

    fn percent(&self, key: &str, value: u8) -> Result<u8, FileError> {
        match value {
            1..=100 => Ok(value),
            _ => Err(self.wrong(key, format!("{value} is not a speed override"), "give 1 to 100")),
        }
    }

    /// A time in units of `unit` seconds; a day is longer than anybody waits.
    fn time(&self, key: &str, value: f64, unit: f64) -> Result<Duration, FileError> {
        let seconds = value * unit;
        if !(0.0..86_400.0).contains(&seconds) {
            return Err(self.wrong(key, format!("{value} is not a waiting time"), "give zero or more, less than a day"));
        }
        Ok(Duration::from_secs_f64(seconds))
    }

    fn robot(&self, robot: &RobotToml, joints: usize) -> Result<KukaSettings, FileError> {
        self.address("robot.address", &robot.address)?;
        for (key, name) in robot.variables.needed(robot.program) {
            if name.is_empty() || name.chars().any(|c| c.is_whitespace() || c.is_control()) {
                let key = format!("robot.variables.{key}");
                return Err(self.wrong(
                    &key,
                    format!("{name:?} is not the name of a variable"),
                    "name one of the controller's",
                ));
            }
        }
        let p = &robot.patience;
        Ok(KukaSettings {
            address: robot.address.clone(),
            joints,
            program: robot.program,
            variables: robot.variables.clone(),
            actions: robot.actions.clone(),
            fitness: robot.fitness.clone(),
            patience: Patience {
                // Nobody connects in no time.
                connect: self.time("robot.patience.connect_s", self.positive("robot.patience.connect_s", p.connect_s)?, 1.0)?,
                answer: self.time("robot.patience.answer_s", self.positive("robot.patience.answer_s", p.answer_s)?, 1.0)?,
                motion: self.time("robot.patience.motion_s", self.positive("robot.patience.motion_s", p.motion_s)?, 1.0)?,
                poll: self.time("robot.patience.poll_ms", p.poll_ms, 1e-3)?,
                settle: self.time("robot.patience.settle_s", p.settle_s, 1.0)?,
                reconnects: p.reconnects,
            },
        })
    }

    fn address(&self, key: &str, address: &str) -> Result<(), FileError> {
        let is_one = address.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
        if is_one { Ok(()) } else { Err(self.wrong(key, format!("'{address}' is no address"), "give it as HOST:PORT")) }
    }

    fn indicators(&self, tables: &[IndicatorToml]) -> Result<[CellIndicator; 3], FileError> {
        let mut found: [Option<CellIndicator>; 3] = [None, None, None];
        for (k, table) in tables.iter().enumerate() {
            let place = &mut found[table.axis as usize];
            if place.is_some() {
                let key = format!("indicator[{k}].axis");
                return Err(self.wrong(&key, "another indicator is on this axis", "give each of x, y, z one indicator"));
            }
            *place = Some(self.indicator(k, table)?);
        }
        match found {
            [Some(x), Some(y), Some(z)] => Ok([x, y, z]),
            _ => Err(self.wrong("indicator", format!("there are {}", tables.len()), "give three, of the axes x, y and z")),
        }
    }

    fn indicator(&self, k: usize, table: &IndicatorToml) -> Result<CellIndicator, FileError> {
        let key = |field: &str| format!("indicator[{k}].{field}");
        let Some(dialect) = Dialect::named(&table.dialect) else {
            let remedy = name_remedy(&table.dialect, &Dialect::ALL.map(|dialect| dialect.name));
            return Err(self.wrong(&key("dialect"), format!("`{}` is not known", table.dialect), &remedy));
        };
        let line = match &table.line {
            None => dialect.line,
            Some(text) => LineSettings::parse(text).ok_or_else(|| {
                self.wrong(&key("line"), format!("'{text}' is not understood"), "give it as `4800 7E2` or `9600 8N1`")
            })?,
        };
        let place = match (&table.port, &table.address) {
            (Some(port), None) => Place::Serial(port.clone(), line),
            (None, Some(address)) => {
                self.address(&key("address"), address)?;
                Place::Socket(address.clone())
            }
            _ => {
                let remedy = "give either `port`, a serial port, or `address`, as HOST:PORT";
                return Err(self.wrong(&format!("indicator[{k}]"), "where it is found is not said once", remedy));
            }
        };
        let mut settings = IndicatorSettings { counts_down: table.counts_down, ..IndicatorSettings::new(dialect) };
        if let Some(value) = table.timeout_s {
            settings.timeout = self.time(&key("timeout_s"), self.positive(&key("timeout_s"), value)?, 1.0)?;
        }
        if let Some(value) = table.echo_s {
            settings.echo = self.time(&key("echo_s"), value, 1.0)?;
        }
        Ok(CellIndicator { place, settings })
    }

    fn guards(&self, guards: &GuardsToml, dataset: &Dataset) -> Result<Guards, FileError> {
        let max_step = self.positive("guards.max_step_mm", guards.max_step_mm)? * MM;
        // To rounding.
        if max_step > LONGEST_STEP * (1.0 + 1e-12) {
            let problem = format!("{} mm are more than the safe range of the gauge", guards.max_step_mm);
            return Err(self.wrong("guards.max_step_mm", problem, "give 5 or less"));
        }
        if guards.joint_margin_deg < 0.0 {
            let problem = format!("{} is negative", guards.joint_margin_deg);
            return Err(self.wrong("guards.joint_margin_deg", problem, "give zero or more"));
        }
        let workspace = guards.workspace_mm.map(|corners| corners.map(|corner| Vector3::from(corner) * MM));
        if workspace.is_some_and(|[low, high]| (0..3).any(|k| low[k] >= high[k])) {
            let remedy = "give the lower corner, then the upper one";
            return Err(self.wrong("guards.workspace_mm", "the box is empty", remedy));
        }
        Ok(Guards {
            robot: dataset.robot.clone(),
            base: dataset.base,
            tool: dataset.tool,
            joint_margin: guards.joint_margin_deg * DEG,
            max_step,
            workspace,
        })
    }

    fn trical(&self, trical: &TriCalToml) -> Result<TriCal, FileError> {
        let radius = |key: &str, diameter: f64| Ok(0.5 * self.positive(key, diameter)? * MM);
        let trical = TriCal {
            datum_radius: radius("trical.datum_diameter_mm", trical.datum_diameter_mm)?,
            master_radius: radius("trical.master_diameter_mm", trical.master_diameter_mm)?,
            travel: self.positive("trical.travel_mm", trical.travel_mm)? * MM,
            tip_radius: radius("trical.tip_diameter_mm", trical.tip_diameter_mm)?,
            safe_range: LONGEST_STEP,
        };
        if trical.master_radius <= trical.datum_radius {
            let remedy = "give the larger of the two as the master ball";
            return Err(self.wrong("trical.master_diameter_mm", "the master ball is not larger than the datum balls", remedy));
        }
        Ok(trical)
    }
}
