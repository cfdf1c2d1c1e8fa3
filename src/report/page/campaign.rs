//! How a campaign went, as its folder tells: every ball centred reading by reading.

use std::path::Path;

use serde_json::{Value, json};

use super::short;
use crate::files::{FileError, read_text};

/// One try at a ball.
#[derive(Debug, Clone, PartialEq)]
pub struct CentringRecord {
    /// The planned pose.
    pub id: String,
    /// The ball.
    pub ball: String,
    /// `centred`, or the name of the failure.
    pub outcome: String,
    /// How long it took, s.
    pub duration_s: f64,
    /// Length of the indicators' reading at every stop on the ball, um; what is left to centre.
    pub readings_um: Vec<f64>,
}

/// All tries of a campaign, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignRecord {
    /// The tries.
    pub centrings: Vec<CentringRecord>,
}

impl CampaignRecord {
    /// Reads `probings.csv` and `iterations.csv` of a folder; `None` where the folder has none.
    ///
    /// # Errors
    /// One that names file, line, column and remedy.
    pub fn read(folder: &Path) -> Result<Option<Self>, FileError> {
        let [probings, stops] = ["probings.csv", "iterations.csv"].map(|name| folder.join(name));
        if !probings.is_file() || !stops.is_file() {
            return Ok(None);
        }
        let mut centrings = Vec::new();
        for row in Table::read(&probings)?.rows(["id", "ball", "outcome", "duration_s"])? {
            let [id, ball, outcome, duration] = &row.fields;
            centrings.push(CentringRecord {
                id: id.clone(),
                ball: ball.clone(),
                outcome: outcome.clone(),
                duration_s: row.number(&probings, "duration_s", duration)?.unwrap_or_default(),
                readings_um: Vec::new(),
            });
        }
        for row in Table::read(&stops)?.rows(["probing", "phase", "r1_um", "r2_um", "r3_um"])? {
            let [probing, phase, readings @ ..] = &row.fields;
            let centring = probing.parse::<usize>().ok().and_then(|k| centrings.get_mut(k.checked_sub(1)?));
            let centring =
                centring.ok_or_else(|| row.wrong(&stops, "probing", format!("'{probing}' is no row of probings.csv")))?;
            if phase != "centring" {
                continue;
            }
            let mut squares = Some(0.0);
            for (name, text) in ["r1_um", "r2_um", "r3_um"].into_iter().zip(readings) {
                squares = squares.zip(row.number(&stops, name, text)?).map(|(sum, x): (f64, f64)| sum + x * x);
            }
            centring.readings_um.extend(squares.map(f64::sqrt));
        }
        Ok(Some(CampaignRecord { centrings }))
    }

    pub(super) fn json(&self) -> Value {
        self.centrings
            .iter()
            .map(|c| {
                json!({"id": c.id, "ball": c.ball, "outcome": c.outcome, "duration_s": short(c.duration_s),
                    "readings_um": super::shorts(c.readings_um.iter().copied())})
            })
            .collect()
    }
}

/// A table of a campaign.
struct Table<'a> {
    path: &'a Path,
    text: String,
}

/// Some columns of a row, and its line.
struct Row<const N: usize> {
    line: Option<usize>,
    fields: [String; N],
}

impl<'a> Table<'a> {
    fn read(path: &'a Path) -> Result<Self, FileError> {
        Ok(Table { path, text: read_text(path)? })
    }

    fn rows<const N: usize>(&self, columns: [&str; N]) -> Result<Vec<Row<N>>, FileError> {
        let remedy = "every row needs the columns of the header";
        let fail = |e: csv::Error| FileError {
            line: e.position().map(|p| p.line() as usize),
            ..FileError::whole(self.path, e.to_string(), remedy)
        };
        let mut reader = csv::Reader::from_reader(self.text.as_bytes());
        let header = reader.headers().map_err(fail)?.clone();
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(columns) {
            *place = header.iter().position(|h| h == name).ok_or_else(|| FileError {
                line: Some(1),
                field: name.into(),
                ..FileError::whole(self.path, "the column is missing", "give the file as `calibench run` wrote it")
            })?;
        }
        let row = |record: Result<csv::StringRecord, csv::Error>| {
            let record = record.map_err(fail)?;
            let line = record.position().map(|p| p.line() as usize);
            Ok(Row { line, fields: places.map(|k| record.get(k).unwrap_or_default().to_owned()) })
        };
        reader.records().map(row).collect()
    }
}

impl<const N: usize> Row<N> {
    fn wrong(&self, path: &Path, field: &str, problem: String) -> FileError {
        let remedy = "give the file as `calibench run` wrote it";
        FileError { line: self.line, field: field.into(), ..FileError::whole(path, problem, remedy) }
    }

    /// A finite number, or nothing in an empty field.
    fn number(&self, path: &Path, field: &str, text: &str) -> Result<Option<f64>, FileError> {
        match text.parse::<f64>() {
            _ if text.is_empty() => Ok(None),
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.wrong(path, field, format!("'{text}' is no finite number"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_on_the_ball_are_kept_and_others_are_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
        assert_eq!(CampaignRecord::read(folder.path()).expect("no files"), None);
        write("probings.csv", "id,ball,outcome,duration_s\np1,A,centred,12.5\n");
        write(
            "iterations.csv",
            "probing,phase,r1_um,r2_um,r3_um\n1,approach,-6000,-6000,-6000\n1,centring,3,4,12\n1,centring,,,\n1,centring,0,0,1\n",
        );
        let record = CampaignRecord::read(folder.path()).expect("readable").expect("there");
        assert_eq!(record.centrings[0].readings_um, [13.0, 1.0]);
        write("iterations.csv", "probing,phase,r1_um,r2_um,r3_um\n2,centring,3,4,12\n");
        let error = CampaignRecord::read(folder.path()).expect_err("no such probing").to_string();
        assert!(error.contains("iterations.csv:2: probing: '2'"), "{error}");
    }
}
