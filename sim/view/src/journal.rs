//! The journal of a campaign: every stop of the arm, from `probings.csv` and `iterations.csv`.

use std::path::Path;

use calibench::files::{FileError, read_text};
use calibench::units::{DEG, UM};
use nalgebra::Vector3;

/// One try at a ball.
#[derive(Debug, Clone, PartialEq)]
pub struct Try {
    /// The planned pose, whose name the sample carries.
    pub id: String,
    /// The ball.
    pub ball: String,
    /// `centred`, or the name of the failure.
    pub outcome: String,
}

/// One stop of the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// The try that it belongs to, by place.
    pub probing: usize,
    /// On the ball, not before it or back from it.
    pub on_ball: bool,
    /// Since the session began, s.
    pub time_s: Option<f64>,
    /// Joints read back, rad (N).
    pub joints: Vec<f64>,
    /// What the indicators said, m: the ball's centre in the tool frame.
    pub reading: Option<Vector3<f64>>,
}

/// A campaign, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Journal {
    /// Its tries.
    pub tries: Vec<Try>,
    /// Its stops.
    pub stops: Vec<Stop>,
}

impl Journal {
    /// Reads the journal of an arm of so many joints; `None` where the folder has none.
    ///
    /// # Errors
    /// When a column is missing, a value is no number, or a row belongs to no probing.
    pub fn read(folder: &Path, joints: usize) -> Result<Option<Self>, FileError> {
        let [probings, iterations] = ["probings.csv", "iterations.csv"].map(|name| folder.join(name));
        if !probings.is_file() || !iterations.is_file() {
            return Ok(None);
        }
        let mut journal = Journal::default();
        Table::read(&probings)?.each(&mut |row| {
            let text = |column: &str| Ok::<_, FileError>(row.text(column)?.to_owned());
            journal.tries.push(Try { id: text("id")?, ball: text("ball")?, outcome: text("outcome")? });
            Ok(())
        })?;
        Table::read(&iterations)?.each(&mut |row| {
            let number = row.text("probing")?;
            let probing = number.parse::<usize>().ok().filter(|k| (1..=journal.tries.len()).contains(k));
            let probing = probing.ok_or_else(|| row.wrong("probing", format!("'{number}' is no row of probings.csv")))?;
            let joints = (1..=joints).map(|j| row.number(&format!("q{j}_deg"))).collect::<Result<Option<Vec<f64>>, _>>()?;
            // A stop at which not even the joints are known shows nothing.
            let Some(joints) = joints else { return Ok(()) };
            let [x, y, z] = [row.number("r1_um")?, row.number("r2_um")?, row.number("r3_um")?];
            journal.stops.push(Stop {
                probing: probing - 1,
                on_ball: row.text("phase")? == "centring",
                time_s: row.number("time_s")?,
                joints: joints.into_iter().map(|q| q * DEG).collect(),
                reading: x.zip(y).zip(z).map(|((x, y), z)| Vector3::new(x, y, z) * UM),
            });
            Ok(())
        })?;
        Ok(Some(journal))
    }

    /// The stop at which a try is shown when only tries are counted: the last on the ball, else the last of all.
    pub fn settled(&self, probing: usize) -> Option<usize> {
        let of_it = |k: &usize| self.stops[*k].probing == probing;
        let last = |on_ball: bool| (0..self.stops.len()).rev().filter(of_it).find(|&k| !on_ball || self.stops[k].on_ball);
        last(true).or_else(|| last(false))
    }
}

/// A table as text.
struct Table<'a> {
    path: &'a Path,
    text: String,
}

/// A row of it.
struct Row<'a> {
    path: &'a Path,
    header: &'a csv::StringRecord,
    record: csv::StringRecord,
}

impl<'a> Table<'a> {
    fn read(path: &'a Path) -> Result<Self, FileError> {
        Ok(Table { path, text: read_text(path)? })
    }

    fn each(&self, visit: &mut dyn FnMut(Row<'_>) -> Result<(), FileError>) -> Result<(), FileError> {
        let fail = |e: csv::Error| FileError {
            line: e.position().map(|p| p.line() as usize),
            ..FileError::whole(self.path, e.to_string(), "every row needs the columns of the header")
        };
        let mut reader = csv::Reader::from_reader(self.text.as_bytes());
        let header = reader.headers().map_err(fail)?.clone();
        for record in reader.records() {
            visit(Row { path: self.path, header: &header, record: record.map_err(fail)? })?;
        }
        Ok(())
    }
}

impl Row<'_> {
    fn text(&self, column: &str) -> Result<&str, FileError> {
        let place = self.header.iter().position(|h| h == column).ok_or_else(|| FileError {
            line: Some(1),
            field: column.into(),
            ..FileError::whole(self.path, "the column is missing", "give the file as `calibench run` wrote it")
        })?;
        Ok(self.record.get(place).unwrap_or_default())
    }

    /// A finite number, or nothing in an empty field.
    fn number(&self, column: &str) -> Result<Option<f64>, FileError> {
        match self.text(column)? {
            "" => Ok(None),
            text => match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(Some(value)),
                _ => Err(self.wrong(column, format!("'{text}' is no finite number"))),
            },
        }
    }

    fn wrong(&self, column: &str, problem: String) -> FileError {
        let line = self.record.position().map(|p| p.line() as usize);
        FileError {
            line,
            field: column.into(),
            ..FileError::whole(self.path, problem, "give the file as `calibench run` wrote it")
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const HEADER: &str = "probing,phase,time_s,q1_deg,q2_deg,r1_um,r2_um,r3_um\n";

    fn journal(probings: &str, iterations: &str) -> Result<Option<Journal>, FileError> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("probings.csv"), probings).unwrap();
        std::fs::write(folder.path().join("iterations.csv"), format!("{HEADER}{iterations}")).unwrap();
        Journal::read(folder.path(), 2)
    }

    #[test]
    fn a_try_is_settled_where_the_ball_was_last_touched() {
        let rows = "1,approach,1,10,20,-6000,-6000,-6000\n1,centring,2,10,20,900,1,1\n1,centring,3,10,21,1,2,3\n1,retreat,4,10,20,,,\n";
        let read = journal("id,ball,outcome\np1,A,centred\n", rows).unwrap().unwrap();
        assert_eq!(read.stops.len(), 4);
        assert_eq!(read.settled(0), Some(2));
        assert_eq!(read.stops[2].reading, Some(Vector3::new(1.0, 2.0, 3.0) * UM));
        assert_eq!(read.stops[3].reading, None);
    }

    #[test]
    fn a_stop_of_no_probing_is_an_error_with_its_line() {
        let error = journal("id,ball,outcome\np1,A,centred\n", "2,approach,1,10,20,,,\n").unwrap_err().to_string();
        assert!(error.contains("iterations.csv:2: probing: '2' is no row"), "{error}");
    }
}
