//! `TARGETS.csv`: desired poses of the TCP, one row per target. Every mistake is reported as one error that names line,
//! column and remedy.

pub use super::fake_file::fake_csv;

use std::collections::{HashMap, HashSet};
use std::io::BufReader;
use std::path::Path;

use super::conditions::Conditions;
use super::{Desired, Target};
use crate::files::disk::{is_folder, open_file};
use crate::files::{FileError, Record, Rows, cannot_be_read, name_remedy, nearest_name};
use crate::measure::dataset::columns::of_other_kind;
use crate::measure::dataset::limits::{TEMPERATURE_C, TIME_S, out_of_range};
use crate::robot::inverse::SphericalWrist;
use crate::robot::statics::Payload;
use crate::robot::{FramePose, JointKind, Robot};
use crate::units::{DEG, MM};

/// Columns of a pose: position, mm, and KUKA's A, B, C, deg.
pub(super) const POSE: [&str; 6] = ["x_mm", "y_mm", "z_mm", "a_deg", "b_deg", "c_deg"];

/// Largest distance of a target from its frame, m: beyond it the unit is wrong.
const FARTHEST: f64 = 1e3;

/// Largest number of rows: a robot program has thousands of points at most.
const MOST_ROWS: usize = 1_000_000;

/// The context in which a file of targets is read.
#[derive(Debug, Clone, Copy)]
pub struct Expected<'a> {
    /// The arm.
    pub robot: &'a Robot,
    /// The payloads that a row may name.
    pub payloads: &'a [Payload],
    /// An effect of the calibration that depends on the robot's temperature, so that every row must state it.
    pub by_temperature: Option<&'a str>,
}

/// Reads targets.
///
/// # Errors
/// A single error that names file, line, column and remedy.
pub fn read_targets(path: &Path, expected: &Expected<'_>) -> Result<Vec<Target>, FileError> {
    if is_folder(path) {
        return Err(FileError::whole(path, "is a directory", "name a CSV file of targets"));
    }
    let file = open_file(path).map_err(|e| cannot_be_read(path, e))?;
    let mut rows = Rows::new(BufReader::new(file), path, b',');
    let Some(titles) = rows.next()? else {
        return Err(FileError::whole(path, "is empty", "give a header line and one row a target"));
    };
    let header = Header::parse(path, &titles, expected)?;
    let mut first_seen: HashMap<String, usize> = HashMap::new();
    let mut targets = Vec::new();
    while let Some(record) = rows.next()? {
        let row = Row { path, header: &header, record: &record };
        if targets.len() == MOST_ROWS {
            return Err(row.error("", "the file has more than a million rows".into(), "split it"));
        }
        let target = row.target(expected)?;
        if let Some(line) = first_seen.insert(target.id.clone(), record.line) {
            return Err(row.error(
                "id",
                format!("`{}` is the id of line {line} too", target.id),
                "give every target its own id",
            ));
        }
        targets.push(target);
    }
    if targets.is_empty() {
        return Err(FileError::whole(path, "has a header and no rows", "add one row a target"));
    }
    Ok(targets)
}

/// Index of every column.
struct Header {
    names: Vec<String>,
    place: HashMap<String, usize>,
    poses: bool,
}

impl Header {
    fn parse(path: &Path, titles: &Record, expected: &Expected<'_>) -> Result<Header, FileError> {
        let error = |field: &str, problem: String, remedy: String| titles.wrong(path, field, problem, remedy);
        let names = titles.titles(path, "separate them by commas and write decimal points")?;
        let n = expected.robot.joints();
        let known = columns(expected.robot);
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let mut seen = HashSet::new();
        for name in &names {
            if !seen.insert(name) {
                return Err(error(name, "appears twice in the header".into(), "keep one of them".into()));
            }
            if let Some((problem, remedy)) = of_other_kind(name, expected.robot) {
                return Err(error(name, problem, remedy));
            }
            if !known.contains(&name.as_str()) {
                let remedy = match nearest_name(name, known.iter().copied()) {
                    Some(_) => name_remedy(name, &known),
                    None => format!("remove it; this robot has {n} joints, and known here are {}", known.join(", ")),
                };
                return Err(error(name, "there is no such column".into(), remedy));
            }
            if ["s", "t"].contains(&name.as_str()) && SphericalWrist::new(expected.robot).is_err() {
                let problem = "status and turn are of arms with a spherical wrist, which this is not".into();
                return Err(error(
                    name,
                    problem,
                    format!("remove it, and give {} ... where the posture matters", expected.robot.joint_columns()[0]),
                ));
            }
        }
        let place: HashMap<String, usize> = names.iter().cloned().zip(0..).collect();
        let has = |name: &str| place.contains_key(name);
        let poses = POSE.iter().any(|name| has(name));
        let joints = expected.robot.joint_columns();
        let required: Vec<&str> = if poses { POSE.to_vec() } else { joints.iter().map(String::as_str).collect() };
        let several: [Vec<String>; 2] = [joints.clone(), approaches(n)];
        let begun = several.iter().filter(|columns| columns.iter().any(|c| has(c))).flatten().map(String::as_str);
        let needed = ["id"].into_iter().chain(required).chain(begun).chain(expected.by_temperature.map(|_| "temp_c"));
        if let Some(missing) = { needed }.find(|name| !has(name)) {
            let remedy = match (missing, expected.by_temperature) {
                ("temp_c", Some(effect)) => format!("add it: the calibration's effect '{effect}' depends on the temperature"),
                _ => format!("a target is id with {}, or id with {}", POSE.join(", "), joints.join(", ")),
            };
            return Err(error(missing, "this required column is missing".into(), remedy));
        }
        Ok(Header { names, place, poses })
    }
}

fn approaches(n: usize) -> Vec<String> {
    (1..=n).map(|i| format!("approach{i}")).collect()
}

/// All columns for an arm.
fn columns(robot: &Robot) -> Vec<String> {
    let names = ["id"].into_iter().chain(POSE).chain(["s", "t", "payload", "time_s", "temp_c"]).map(str::to_owned);
    names.chain(robot.joint_columns()).chain(approaches(robot.joints())).collect()
}

struct Row<'a> {
    path: &'a Path,
    header: &'a Header,
    record: &'a Record,
}

impl<'a> Row<'a> {
    fn error(&self, column: &str, problem: String, remedy: &str) -> FileError {
        FileError { line: Some(self.record.line), field: column.into(), ..FileError::whole(self.path, problem, remedy) }
    }

    fn text(&self, column: &str) -> Option<&'a str> {
        let place = self.header.place.get(column)?;
        self.record.fields.get(*place).map(str::trim).filter(|text| !text.is_empty())
    }

    /// A finite number in SI, if there is one.
    fn number(&self, column: &str, unit: f64) -> Result<Option<f64>, FileError> {
        let Some(text) = self.text(column) else { return Ok(None) };
        match text.parse::<f64>() {
            Ok(value) if (value * unit).is_finite() => Ok(Some(value * unit)),
            Ok(_) => Err(self.error(column, format!("`{text}` is not a finite number"), "give a number, or leave the row out")),
            Err(_) if text.contains(',') => {
                Err(self.error(column, format!("`{text}` has a decimal comma"), "write a decimal point"))
            }
            Err(_) => Err(self.error(column, format!("`{text}` is not a number"), "give a number without its unit")),
        }
    }

    /// A number within the limits of its column, if there is one.
    fn possible(&self, column: &str, limits: [f64; 2]) -> Result<Option<f64>, FileError> {
        let value = self.number(column, 1.0)?;
        match value.and_then(|v| out_of_range(v, limits)) {
            Some(problem) => Err(self.error(column, problem, "give it in the unit of the column, or leave it empty")),
            None => Ok(value),
        }
    }

    fn required(&self, column: &str, unit: f64) -> Result<f64, FileError> {
        self.number(column, unit)?.ok_or_else(|| self.error(column, "is empty".into(), "fill it"))
    }

    /// All numbers of these columns, or `None` if all are empty.
    fn numbers(&self, columns: &[String], unit: f64) -> Result<Option<Vec<f64>>, FileError> {
        if columns.iter().all(|c| self.text(c).is_none()) {
            return Ok(None);
        }
        columns.iter().map(|c| self.required(c, unit)).collect::<Result<_, _>>().map(Some)
    }

    /// A whole number from 0 to `most`, if there is one.
    fn bits(&self, column: &str, most: u8) -> Result<Option<u8>, FileError> {
        let Some(text) = self.text(column) else { return Ok(None) };
        match text.parse::<u8>() {
            Ok(bits) if bits <= most => Ok(Some(bits)),
            _ => Err(self.error(
                column,
                format!("`{text}` is not such a number"),
                &format!("give a whole number from 0 to {most}"),
            )),
        }
    }

    fn pose(&self) -> Result<FramePose, FileError> {
        let mut numbers = [0.0; 6];
        for (k, (number, column)) in numbers.iter_mut().zip(POSE).enumerate() {
            *number = self.required(column, if k < 3 { MM } else { DEG })?;
            if k < 3 && number.abs() > FARTHEST {
                return Err(self.error(column, "is more than a kilometre away".into(), "give it in mm"));
            }
        }
        Ok(FramePose::from_array(numbers))
    }

    fn target(&self, expected: &Expected<'_>) -> Result<Target, FileError> {
        let (fields, columns) = (self.record.fields.len(), self.header.names.len());
        if fields != columns {
            let problem = format!("the row has {fields} fields, the header {columns}");
            return Err(self.error(
                "",
                problem,
                "give every column a field; an empty one is written as nothing between commas",
            ));
        }
        let n = expected.robot.joints();
        let id = self.text("id").ok_or_else(|| self.error("id", "is empty".into(), "fill it"))?;
        if id.contains(char::is_control) {
            return Err(self.error("id", "has control characters".into(), "give a plain name"));
        }
        let columns = expected.robot.joint_columns();
        let si = |(value, kind): (f64, JointKind)| value * kind.unit().si;
        let near: Option<Vec<f64>> =
            self.numbers(&columns, 1.0)?.map(|values| values.into_iter().zip(expected.robot.kinds()).map(si).collect());
        let desired = if self.header.poses {
            let (status, turn) = (self.bits("s", 7)?, self.bits("t", 63)?);
            Desired::Pose { pose: self.pose()?.pose(), near, status, turn }
        } else {
            if let Some(column) = ["s", "t"].into_iter().find(|c| self.text(c).is_some()) {
                let problem = "has no meaning where the joints are given".into();
                return Err(self.error(column, problem, "leave it empty: the joints say which posture is meant"));
            }
            Desired::Joints(near.ok_or_else(|| self.error(&columns[0], "is empty".into(), "fill it"))?)
        };
        let sign = |(k, value): (usize, f64)| match value {
            -1.0 => Ok(-1),
            0.0 => Ok(0),
            1.0 => Ok(1),
            _ => Err(self.error(&format!("approach{}", k + 1), format!("{value} is not a sign"), "write one of -1, 0, 1")),
        };
        let approach = self.numbers(&approaches(n), 1.0)?;
        let approach = approach.map(|signs| signs.into_iter().enumerate().map(sign).collect::<Result<_, _>>()).transpose()?;
        let temp_c = self.possible("temp_c", TEMPERATURE_C)?;
        if let (None, Some(effect)) = (temp_c, expected.by_temperature) {
            let remedy = format!("fill it: the calibration's effect '{effect}' depends on the temperature");
            return Err(self.error("temp_c", "is empty".into(), &remedy));
        }
        let time_s = self.possible("time_s", TIME_S)?;
        let payload = self.text("payload").map(|name| {
            expected.payloads.iter().find(|p| p.name == name).cloned().ok_or_else(|| {
                let known: Vec<&str> = expected.payloads.iter().take(12).map(|p| p.name.as_str()).collect();
                let remedy = if known.is_empty() {
                    "the set-up of the calibration has none; describe the load instead".into()
                } else {
                    format!("the set-up of the calibration has {}; describe any other load instead", known.join(", "))
                };
                self.error("payload", format!("there is no payload `{name}`"), &remedy)
            })
        });
        Ok(Target {
            id: id.into(),
            desired,
            payload: payload.transpose()?,
            conditions: Conditions { time_s, temp_c, approach },
        })
    }
}
