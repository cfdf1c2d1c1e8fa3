//! `samples.csv`: one row per measurement. Every error names line, column and remedy.

use std::collections::HashMap;
use std::io::{BufReader, Read};
use std::path::Path;

use nalgebra::Vector3;
use sha2::{Digest, Sha256};

use super::columns::{Column, KINDS, RowKind, SETS};
use super::joint_limits::impossible;
use super::limits::{POINT_MM, READING_UM, ROTATION_DEG, TEMPERATURE_C, TIME_S, TORQUE_NM, out_of_range};
use super::samples_header::Header;
use super::{Dataset, Measured, Orientation, Sample, SampleSet};
use crate::files::disk::{is_folder, open_file};
use crate::files::{FileError, Record, Rows, name_remedy};
use crate::robot::{JointKind, Robot};
use crate::units::{DEG, MM, UM, readable};

/// Maximum number of rows: a measurement takes seconds, so this is years of them.
const MOST_ROWS: usize = 10_000_000;

/// Reads the rows into `dataset` (samples and names of the free columns), and every byte into `hash`.
pub(super) fn read_samples(path: &Path, dataset: &mut Dataset, hash: &mut Sha256) -> Result<(), FileError> {
    let mut samples = Vec::new();
    dataset.extra_columns = each_sample(path, dataset, hash, &mut |sample| samples.push(sample))?;
    dataset.samples = samples;
    Ok(())
}

/// Reads the rows of a dataset one by one, as [`read_samples`], and keeps none.
pub(super) fn check_samples(path: &Path, dataset: &Dataset) -> Result<(), FileError> {
    each_sample(path, dataset, &mut Sha256::new(), &mut drop).map(drop)
}

/// Passes every sample of a file to `take`; returns the names of the free columns.
fn each_sample(
    path: &Path,
    dataset: &Dataset,
    hash: &mut Sha256,
    take: &mut dyn FnMut(Sample),
) -> Result<Vec<String>, FileError> {
    if is_folder(path) {
        return Err(FileError::whole(path, "is a directory", "put the file samples.csv there"));
    }
    let file = open_file(path).map_err(|e| {
        FileError::whole(path, format!("cannot be read: {e}"), "a dataset is a folder with dataset.toml and samples.csv")
    })?;
    let mut rows = Rows::new(BufReader::new(Hashed { input: file, hash }), path, b',');
    let Some(titles) = rows.next()? else {
        return Err(FileError::whole(path, "is empty", "give a header line and one row a measurement"));
    };
    let header = Header::parse(path, &titles, dataset)?;
    let mut first_seen: HashMap<String, usize> = HashMap::new();
    while let Some(record) = rows.next()? {
        let row = Row { path, header: &header, record: &record };
        if first_seen.len() == MOST_ROWS {
            return Err(FileError {
                line: Some(record.line),
                ..FileError::whole(path, "has more than 10 million rows", "split the dataset")
            });
        }
        let sample = row.sample(dataset)?;
        if let Some(line) = first_seen.insert(sample.id.clone(), record.line) {
            return Err(row.error(
                Column::Id,
                format!("`{}` is the id of line {line} too", sample.id),
                "give every row its own id",
            ));
        }
        take(sample);
    }
    if first_seen.is_empty() {
        return Err(FileError::whole(path, "has a header and no rows", "add one row a measurement"));
    }
    Ok(header.extra.into_iter().map(|(name, _)| name).collect())
}

/// A reader that hashes the bytes read.
struct Hashed<'a, R> {
    input: R,
    hash: &'a mut Sha256,
}

impl<R: Read> Read for Hashed<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.input.read(buffer)?;
        self.hash.update(&buffer[..read]);
        Ok(read)
    }
}

/// One row, read by column.
pub(crate) struct Row<'a> {
    pub path: &'a Path,
    pub header: &'a Header,
    pub record: &'a Record,
}

impl<'a> Row<'a> {
    fn error(&self, column: Column, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        FileError { line: Some(self.record.line), field: column.name(), ..FileError::whole(self.path, problem, remedy) }
    }

    fn text(&self, column: Column) -> Option<&'a str> {
        let place = self.header.place.get(&column)?;
        self.record.fields.get(*place).map(str::trim).filter(|t| !t.is_empty())
    }

    fn required(&self, column: Column) -> Result<&'a str, FileError> {
        self.text(column).ok_or_else(|| self.error(column, "is empty", "fill it"))
    }

    /// A finite number in SI, if there is one.
    fn number(&self, column: Column, unit: f64) -> Result<Option<f64>, FileError> {
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

    /// All numbers of a quantity in SI, or none.
    fn numbers(&self, component: impl Fn(usize) -> Column, count: usize, unit: f64) -> Result<Option<Vec<f64>>, FileError> {
        let mut values = Vec::with_capacity(count);
        let mut gap = None;
        for k in 0..count {
            match self.number(component(k), unit)? {
                Some(value) => values.push(value),
                None => gap = gap.or(Some(component(k))),
            }
        }
        match gap {
            None => Ok(Some(values)),
            Some(_) if values.is_empty() => Ok(None),
            Some(column) => {
                Err(self.error(column, "is empty while its fellows are not", "fill it, or leave all of them empty"))
            }
        }
    }

    /// Three plausible numbers; the limits are in the unit of the columns.
    fn vector(&self, component: fn(usize) -> Column, unit: f64, limits: [f64; 2]) -> Result<Option<Vector3<f64>>, FileError> {
        let numbers = self.numbers(component, 3, unit)?;
        for (k, value) in numbers.iter().flatten().enumerate() {
            self.possible(component(k), limits, Some(readable(*value, unit)))?;
        }
        Ok(numbers.map(|v| Vector3::new(v[0], v[1], v[2])))
    }

    /// All signs of a quantity, or none.
    fn signs(&self, component: fn(usize) -> Column, count: usize, allowed: &[i8]) -> Result<Option<Vec<i8>>, FileError> {
        let Some(values) = self.numbers(component, count, 1.0)? else { return Ok(None) };
        let sign = |(k, value): (usize, f64)| {
            allowed.iter().copied().find(|&s| f64::from(s) == value).ok_or_else(|| {
                let list: Vec<String> = allowed.iter().map(i8::to_string).collect();
                self.error(component(k), format!("{value} is not a sign"), format!("write one of {}", list.join(", ")))
            })
        };
        values.into_iter().enumerate().map(sign).collect::<Result<_, _>>().map(Some)
    }

    /// A plausible number greater than zero, if there is one.
    fn positive(&self, column: Column, unit: f64, limits: [f64; 2]) -> Result<Option<f64>, FileError> {
        let number = self.number(column, unit)?;
        self.possible(column, limits, number.map(|v| readable(v, unit)))?;
        match number {
            Some(value) if value <= 0.0 => {
                Err(self.error(column, "is not greater than zero", "give a positive number, or leave it empty"))
            }
            value => Ok(value),
        }
    }

    /// The index of a name in a list.
    fn named<'b>(
        &self,
        column: Column,
        name: &str,
        what: &str,
        ids: impl Iterator<Item = &'b str> + Clone,
    ) -> Result<usize, FileError> {
        ids.clone().position(|id| id == name).ok_or_else(|| {
            let known: Vec<&str> = ids.take(12).collect();
            let remedy = if known.is_empty() {
                format!("add a [[{what}]] to dataset.toml")
            } else {
                format!("dataset.toml has {}", known.join(", "))
            };
            self.error(column, format!("there is no {what} `{name}`"), remedy)
        })
    }

    fn measured(&self, dataset: &Dataset) -> Result<Measured, FileError> {
        let kind = self.required(Column::Kind)?;
        let measured = match kind {
            "ball" => {
                let ids = dataset.balls.iter().map(|b| b.id.as_str());
                let ball = self.named(Column::Ball, self.required(Column::Ball)?, "ball", ids)?;
                Measured::Ball { ball, reading: self.vector(Column::Reading, UM, READING_UM)? }
            }
            "point" | "pose" => {
                let remedy = format!("a row of kind `{kind}` has x_mm, y_mm, z_mm");
                let empty = || self.error(Column::World(0), "is empty", remedy.as_str());
                Measured::Point(self.vector(Column::World, MM, POINT_MM)?.ok_or_else(empty)?)
            }
            "distance" => {
                let ids = dataset.anchors.iter().map(|a| a.id.as_str());
                let anchor = self.named(Column::Anchor, self.required(Column::Anchor)?, "anchor", ids)?;
                self.required(Column::Distance)?;
                let empty = || self.error(Column::Distance, "is empty", "fill it");
                Measured::Distance { anchor, distance: self.positive(Column::Distance, MM, POINT_MM)?.ok_or_else(empty)? }
            }
            other => {
                return Err(self.error(
                    Column::Kind,
                    format!("`{other}` is not a kind"),
                    name_remedy(other, &KINDS.map(|known| known.name)),
                ));
            }
        };
        let own = |column: &Column| KINDS.iter().any(|known| known.name == kind && known.columns().any(|c| c == *column));
        let mut bound = KINDS.iter().flat_map(RowKind::columns);
        if let Some(stray) = bound.find(|c| !own(c) && self.text(*c).is_some()) {
            return Err(self.error(
                stray,
                format!("has no meaning in a row of kind `{kind}`"),
                "leave it empty, or correct the kind",
            ));
        }
        Ok(measured)
    }

    /// The orientation of the tool, in a row of kind `pose`.
    fn orientation(&self, dataset: &Dataset) -> Result<Option<Orientation>, FileError> {
        if self.text(Column::Kind) != Some("pose") {
            return Ok(None);
        }
        let rotation = self.vector(Column::Rotation, DEG, ROTATION_DEG)?.ok_or_else(|| {
            self.error(Column::Rotation(0), "is empty", "a row of kind `pose` has rx_deg, ry_deg, rz_deg, a rotation vector")
        })?;
        let sigma = self.positive(Column::SigmaOrientation, DEG, ROTATION_DEG)?;
        if sigma.or(dataset.noise.orientation).is_none() {
            let problem = "is empty, and dataset.toml does not state the noise of an orientation";
            let remedy =
                "fill it, or add `orientation_deg` to [noise]: how orientations and positions are weighted follows from it";
            return Err(self.error(Column::SigmaOrientation, problem, remedy));
        }
        Ok(Some(Orientation { rotation, sigma }))
    }

    fn tool_target(&self, dataset: &Dataset) -> Result<Option<usize>, FileError> {
        let ids = dataset.tool_targets.iter().map(|r| r.id.as_str());
        self.text(Column::Target).map(|name| self.named(Column::Target, name, "target", ids)).transpose()
    }

    /// The measurement of this row.
    pub fn sample(&self, dataset: &Dataset) -> Result<Sample, FileError> {
        self.count_fields()?;
        let robot: &Robot = &dataset.robot;
        let joints = robot.joints();
        let id = self.required(Column::Id)?;
        for column in [Column::Id, Column::Session, Column::Posture, Column::Repeat] {
            if self.text(column).is_some_and(|name| name.contains(char::is_control)) {
                return Err(self.error(column, "has control characters", "give a plain name"));
            }
        }
        for k in 0..joints {
            self.required(Column::joint(robot, k))?;
        }
        let q = self.positions(robot, Column::joint)?.unwrap_or_default();
        self.possible_joints(robot, &q)?;
        let set = match self.text(Column::Set) {
            None => SampleSet::Fit,
            Some(name) if name == SETS[0] => SampleSet::Fit,
            Some(name) if name == SETS[1] => SampleSet::Validation,
            Some(other) => {
                return Err(self.error(Column::Set, format!("`{other}` is not a set"), "write `fit` or `validation`"));
            }
        };
        let payload = match self.text(Column::Payload) {
            None => 0,
            Some(name) => self.named(Column::Payload, name, "payload", dataset.payloads.iter().map(|p| p.name.as_str()))?,
        };
        Ok(Sample {
            set,
            payload,
            time_s: self.possible(Column::Time, TIME_S, self.number(Column::Time, 1.0)?)?,
            temp_c: self.possible(Column::Temperature, TEMPERATURE_C, self.number(Column::Temperature, 1.0)?)?,
            approach: self.signs(Column::Approach, joints, &[-1, 0, 1])?,
            plungers: self.signs(Column::Plunger, 3, &[-1, 1])?.map(|s| [s[0], s[1], s[2]]),
            posture: self.text(Column::Posture).map(str::to_owned),
            repeat: self.text(Column::Repeat).map(str::to_owned),
            session: self.text(Column::Session).map(str::to_owned),
            q_commanded: self.positions(robot, Column::commanded)?,
            commanded: self.vector(Column::CommandedPoint, MM, POINT_MM)?,
            tau: self.torques(robot)?,
            sigma: self.positive(Column::Sigma, UM, READING_UM)?,
            extra: self
                .header
                .extra
                .iter()
                .map(|(_, place)| self.record.fields.get(*place).unwrap_or_default().to_owned())
                .collect(),
            tool_target: self.tool_target(dataset)?,
            orientation: self.orientation(dataset)?,
            ..Sample::new(id, q, self.measured(dataset)?)
        })
    }

    /// Checks that a number is plausible.
    fn possible(&self, column: Column, limits: [f64; 2], value: Option<f64>) -> Result<Option<f64>, FileError> {
        match value.and_then(|v| out_of_range(v, limits)) {
            Some(problem) => Err(self.error(column, problem, "give it in the unit of the column, or leave it empty")),
            None => Ok(value),
        }
    }

    fn torques(&self, robot: &Robot) -> Result<Option<Vec<f64>>, FileError> {
        let torques = self.numbers(|k| Column::load(robot, k), robot.joints(), 1.0)?;
        for (k, tau) in torques.iter().flatten().enumerate() {
            self.possible(Column::load(robot, k), TORQUE_NM, Some(*tau))?;
        }
        Ok(torques)
    }

    /// Positions of all joints, SI, or none.
    fn positions(&self, robot: &Robot, column: fn(&Robot, usize) -> Column) -> Result<Option<Vec<f64>>, FileError> {
        let plain = self.numbers(|k| column(robot, k), robot.joints(), 1.0)?;
        let si = |(value, kind): (f64, JointKind)| value * kind.unit().si;
        Ok(plain.map(|plain| plain.into_iter().zip(robot.kinds()).map(si).collect()))
    }

    fn possible_joints(&self, robot: &Robot, q: &[f64]) -> Result<(), FileError> {
        let Some(k) = impossible(robot, q) else { return Ok(()) };
        let unit = robot.kind(k).unit();
        let [low, high] = robot.links[k].limits.map(|l| readable(l, unit.si));
        let problem = format!("{} {} is outside the joint's limits {low} to {high}", readable(q[k], unit.si), unit.symbol);
        let remedy = match robot.kind(k) {
            JointKind::Revolute => "give the angle in degrees as the controller reports it",
            JointKind::Prismatic => "give the position in millimetres as the controller reports it",
        };
        Err(self.error(Column::joint(robot, k), problem, remedy))
    }

    fn count_fields(&self) -> Result<(), FileError> {
        let (has, needs) = (self.record.fields.len(), self.header.names.len());
        if has == needs {
            return Ok(());
        }
        let error = |problem: String, remedy: &str| FileError {
            line: Some(self.record.line),
            field: self.header.names.get(has).cloned().unwrap_or_default(),
            ..FileError::whole(self.path, problem, remedy)
        };
        if has < needs && self.record.cut {
            return Err(error(
                format!("the last line is cut: {has} of {needs} fields"),
                "restore it from its source, or remove it",
            ));
        }
        let remedy = if has > needs {
            "write decimal points, and text with commas in quotes"
        } else {
            "fill the row; a value not known is left empty between two commas"
        };
        Err(error(format!("{has} fields, and the header has {needs}"), remedy))
    }
}
