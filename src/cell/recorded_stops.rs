//! The rows of a campaign's `iterations.csv`, read back for the replay.

use std::path::Path;

use nalgebra::Vector3;

use super::{IndicatorError, ManipulatorError};
use crate::files::{FileError, read_text};
use crate::units::{DEG, UM};

/// One stop of a recorded arm, a row of `iterations.csv`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stop {
    pub(super) time_s: f64,
    pub(super) joints: Vec<f64>,
    pub(super) reading: Option<Vector3<f64>>,
    pub(super) step: Option<Vector3<f64>>,
    pub(super) fault: Option<Fault>,
}

/// What a device answered in the place of a result.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Fault {
    Indicator(usize, IndicatorError),
    Robot(ManipulatorError),
    /// It said it moved, and its joints were elsewhere.
    StoodStill,
}

/// Reads the stops of a recorded campaign.
pub(super) fn read_stops(path: &Path) -> Result<Vec<Stop>, FileError> {
    Table::read(path)?.stops()
}

/// `iterations.csv` as text.
struct Table<'a> {
    path: &'a Path,
    header: csv::StringRecord,
    rows: Vec<csv::StringRecord>,
}

impl<'a> Table<'a> {
    fn read(path: &'a Path) -> Result<Self, FileError> {
        let text = read_text(path)?;
        let fail = |e: csv::Error| FileError {
            line: e.position().map(|p| p.line() as usize),
            ..FileError::whole(path, e.to_string(), "every row needs the columns of the header")
        };
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let header = reader.headers().map_err(fail)?.clone();
        let rows = reader.records().collect::<Result<Vec<_>, _>>().map_err(fail)?;
        Ok(Table { path, header, rows })
    }

    fn column(&self, name: &str) -> Result<usize, FileError> {
        self.header.iter().position(|h| h == name).ok_or_else(|| FileError {
            line: Some(1),
            field: name.into(),
            ..FileError::whole(self.path, "the column is missing", "give the iterations.csv of a campaign")
        })
    }

    fn wrong(&self, row: &csv::StringRecord, field: &str, problem: String, remedy: &str) -> FileError {
        let line = row.position().map(|p| p.line() as usize);
        FileError { line, field: field.into(), ..FileError::whole(self.path, problem, remedy) }
    }

    /// A finite number, or nothing in an empty field.
    fn number(&self, row: &csv::StringRecord, column: usize) -> Result<Option<f64>, FileError> {
        let text = row.get(column).unwrap_or_default();
        if text.is_empty() {
            return Ok(None);
        }
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => {
                let field = self.header.get(column).unwrap_or_default();
                Err(self.wrong(row, field, format!("'{text}' is no finite number"), "write a number, or leave the field empty"))
            }
        }
    }

    fn stops(&self) -> Result<Vec<Stop>, FileError> {
        let (time, fault) = (self.column("time_s")?, self.column("fault")?);
        let mut joints = vec![self.column("q1_deg")?];
        while let Ok(column) = self.column(&format!("q{}_deg", joints.len() + 1)) {
            joints.push(column);
        }
        let mut three = [[0; 3]; 2];
        for (columns, letter) in three.iter_mut().zip(["r", "step"]) {
            for (k, column) in columns.iter_mut().enumerate() {
                *column = self.column(&format!("{letter}{}_um", k + 1))?;
            }
        }
        let vector = |row: &csv::StringRecord, columns: &[usize; 3]| -> Result<Option<Vector3<f64>>, FileError> {
            let [x, y, z] = [self.number(row, columns[0])?, self.number(row, columns[1])?, self.number(row, columns[2])?];
            Ok(x.zip(y).zip(z).map(|((x, y), z)| Vector3::new(x, y, z) * UM))
        };
        let stop = |row: &csv::StringRecord| {
            let mut angles = Vec::with_capacity(joints.len());
            for &column in &joints {
                angles.extend(self.number(row, column)?.map(|q| q * DEG));
            }
            Ok(Stop {
                time_s: self.number(row, time)?.unwrap_or_default(),
                joints: angles,
                reading: vector(row, &three[0])?,
                step: vector(row, &three[1])?,
                fault: self.fault(row, fault, joints.len())?,
            })
        };
        self.rows.iter().map(stop).collect()
    }

    /// The device's answer behind a recorded failure; what the controller concluded from readings it will conclude again.
    fn fault(&self, row: &csv::StringRecord, column: usize, joints: usize) -> Result<Option<Fault>, FileError> {
        let text = row.get(column).unwrap_or_default();
        let (name, place) = text.split_once(':').unwrap_or((text, ""));
        let counted = |of: usize| match place.parse::<usize>() {
            Ok(place) if (1..=of).contains(&place) => Ok(place),
            _ => Err(self.wrong(row, "fault", format!("'{text}' names no indicator or joint"), "put its number after a colon")),
        };
        let indicator = |error| Ok(Some(Fault::Indicator(counted(3)? - 1, error)));
        let robot = |error| Ok(Some(Fault::Robot(error)));
        let as_recorded = || "as recorded".to_owned();
        match name {
            "silent_indicator" => indicator(IndicatorError::Silent),
            "garbled_indicator" => indicator(IndicatorError::Garbled { frame: as_recorded() }),
            "faulty_indicator" => indicator(IndicatorError::Fault { detail: as_recorded() }),
            "plunger_at_stop" => indicator(IndicatorError::OverRange),
            "robot_lost" => robot(ManipulatorError::Lost { detail: as_recorded() }),
            "robot_stopped" => robot(ManipulatorError::Stopped { reason: as_recorded() }),
            "robot_refused" => robot(ManipulatorError::Refused { reason: as_recorded() }),
            "joint_limit" => robot(ManipulatorError::JointLimit { joint: counted(joints)? }),
            "robot_did_not_move" => Ok(Some(Fault::StoodStill)),
            "unreachable" => robot(ManipulatorError::Unreachable),
            _ => Ok(None),
        }
    }
}
