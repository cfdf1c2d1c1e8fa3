//! The journal of a measurement of points, `OUTPUT.journal`: one line of JSON for each posture measured, written before the next
//! one begins, so that nothing that was measured is lost.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use calibench::files::{FileError, cannot_be_read, cannot_be_written};
use calibench::measure::campaign::Conditions;
use calibench::units::MM;
use serde::{Deserialize, Serialize};

use crate::joints::JointUnit;

/// Name and version of the journal's lines.
const FORMAT: &str = "calibench-points-journal/1";

/// A posture and the point measured in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// When, seconds since 1970.
    pub time_s: f64,
    /// Joints, SI: rad, or m of a sliding joint.
    pub q: Vec<f64>,
    /// The point in the instrument's frame, m.
    pub point_m: [f64; 3],
    /// The point's name, where the instrument sends one.
    pub name: Option<String>,
    /// The pose of the plan, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<String>,
    /// Joints as the controller commanded them, rad (N), where it says so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q_commanded: Option<Vec<f64>>,
    /// Temperature of the robot, °C, where it reports one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temp_c: Option<f64>,
    /// Moment of the load about each joint, N·m (N), where the controller measures it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tau: Option<Vec<f64>>,
}

#[derive(Serialize, Deserialize)]
struct Head {
    format: String,
    units: Vec<JointUnit>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    under: Option<Conditions>,
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Entry {
    Row(Row),
    Undo { undo: bool },
}

/// Rows on their way to a table.
pub struct Journal {
    table: PathBuf,
    path: PathBuf,
    file: File,
    units: Vec<JointUnit>,
    rows: Vec<Row>,
}

impl Journal {
    /// Where the journal of a table lies.
    pub fn of(table: &Path) -> PathBuf {
        let mut path = table.as_os_str().to_owned();
        path.push(".journal");
        path.into()
    }

    /// Begins a journal, or goes on with the one that is there if `resume` says so. `units` are those of the joints, in their
    /// number; `under` is what must be unchanged when it goes on, where there is a plan.
    ///
    /// # Errors
    /// If there is a journal and nobody wants to go on, it is of other joints or another plan, another program has it, or the disk
    /// refuses.
    pub fn open(table: &Path, units: &[JointUnit], under: Option<&Conditions>, resume: bool) -> Result<Self, FileError> {
        let path = Journal::of(table);
        let before = match std::fs::read_to_string(&path) {
            Ok(text) if resume => Some(text),
            Ok(_) => {
                let remedy = "add --resume to go on with it, or delete it";
                return Err(FileError::whole(&path, "holds a measurement that was interrupted", remedy));
            }
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => None,
            Err(e) => return Err(cannot_be_read(&path, e)),
        };
        let rows = match &before {
            Some(text) => rows_of(&path, text, units, under)?,
            None => Vec::new(),
        };
        let is_new = before.as_ref().is_none_or(|text| text.is_empty());
        let file = OpenOptions::new().create(true).append(true).open(&path).map_err(|e| cannot_be_written(&path, e))?;
        if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(FileError::whole(
                &path,
                "another program measures into it",
                "end that program, or give another output",
            ));
        }
        let mut journal = Journal { table: table.into(), path, file, units: units.to_vec(), rows };
        if is_new {
            journal.write(&Head { format: FORMAT.into(), units: units.to_vec(), under: under.cloned() })?;
        } else if before.is_some_and(|text| !text.ends_with('\n')) {
            // The line that the interruption tore is ended, and passed over when it is read again.
            journal.file.write_all(b"\n").map_err(|e| cannot_be_written(&journal.path, e))?;
        }
        Ok(journal)
    }

    /// What was measured so far.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a row, which is on the disk afterwards.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn add(&mut self, row: Row) -> Result<(), FileError> {
        self.write(&row)?;
        self.rows.push(row);
        Ok(())
    }

    /// Takes the last row back, and returns it.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn undo(&mut self) -> Result<Option<Row>, FileError> {
        if self.rows.is_empty() {
            return Ok(None);
        }
        self.write(&Entry::Undo { undo: true })?;
        Ok(self.rows.pop())
    }

    /// The table: CSV with a time from its first row on, the joints, the point, and its name where one has any.
    pub fn table(&self) -> String {
        let unit = |k: usize| self.units.get(k).copied().unwrap_or(JointUnit::Deg);
        let joints = self.rows.first().map_or(0, |row| row.q.len());
        let is_named = self.rows.iter().any(|row| row.name.is_some());
        let titles = (0..joints).map(|k| format!("q{}_{}", k + 1, unit(k).outside_name()));
        let mut text = format!("time_s,{},x_mm,y_mm,z_mm", titles.collect::<Vec<_>>().join(","));
        text += if is_named { ",name\n" } else { "\n" };
        let began = self.rows.first().map_or(0.0, |row| row.time_s);
        for row in &self.rows {
            text += &format!("{:.2}", row.time_s - began);
            row.q.iter().enumerate().for_each(|(k, q)| text += &format!(",{:.6}", unit(k).outside(*q)));
            row.point_m.iter().for_each(|x| text += &format!(",{:.5}", x / MM));
            if is_named {
                text += &format!(",\"{}\"", row.name.as_deref().unwrap_or_default().replace('"', "\"\""));
            }
            text.push('\n');
        }
        text
    }

    /// Writes the table, whole, and removes the journal.
    ///
    /// # Errors
    /// If the disk refuses; the journal is then still there.
    pub fn finish(self) -> Result<(), FileError> {
        calibench::files::disk::write_whole(&self.table, self.table().as_bytes())?;
        std::fs::remove_file(&self.path).map_err(|e| cannot_be_written(&self.path, e))
    }

    /// Removes a journal, if it has no rows.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn discard_empty(self) -> Result<(), FileError> {
        if self.rows.is_empty() { self.discard() } else { Ok(()) }
    }

    /// Removes a journal whose rows are elsewhere.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn discard(self) -> Result<(), FileError> {
        std::fs::remove_file(&self.path).map_err(|e| cannot_be_written(&self.path, e))
    }

    fn write(&mut self, line: &impl Serialize) -> Result<(), FileError> {
        let failed = |e| cannot_be_written(&self.path, e);
        let mut text = serde_json::to_string(line).map_err(|e| failed(e.into()))?;
        text.push('\n');
        self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_data()).map_err(failed)
    }
}

/// The time by the wall clock, seconds since 1970.
pub(crate) fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

/// Names and values of conditions.
fn names_of(under: Option<&Conditions>) -> BTreeMap<String, serde_json::Value> {
    let Some(Ok(serde_json::Value::Object(names))) = under.map(serde_json::to_value) else { return BTreeMap::new() };
    names.into_iter().collect()
}

/// The rows of a journal, for an arm whose joints have these units, under these conditions.
fn rows_of(path: &Path, text: &str, units: &[JointUnit], under: Option<&Conditions>) -> Result<Vec<Row>, FileError> {
    let mut lines = text.lines();
    let Some(first) = lines.next() else { return Ok(Vec::new()) };
    let head: Result<Head, _> = serde_json::from_str(first);
    let Some(head) = head.ok().filter(|head| head.format == FORMAT) else {
        return Err(FileError::whole(path, "is not a journal of points", "give another output, or delete it"));
    };
    if head.under.as_ref() != under {
        let (was, is) = (names_of(head.under.as_ref()), names_of(under));
        let differ = was.iter().filter(|(name, value)| is.get(*name) != Some(*value)).map(|(name, _)| name.as_str());
        let what: Vec<&str> = differ.chain(is.keys().filter(|name| !was.contains_key(*name)).map(String::as_str)).collect();
        let problem = format!("was made under other conditions: {}", what.join(", "));
        return Err(FileError::whole(path, problem, "undo the change, or give another output"));
    }
    if head.units != units {
        let problem = format!("was made with {} joints of other units or number", head.units.len());
        return Err(FileError::whole(path, problem, "undo the change of the station, or begin another table"));
    }
    let mut rows = Vec::new();
    for line in lines {
        // A line torn by an interruption holds nothing that was confirmed.
        match serde_json::from_str(line) {
            Ok(Entry::Row(row)) => rows.push(row),
            Ok(Entry::Undo { .. }) => drop(rows.pop()),
            Err(_) => {}
        }
    }
    Ok(rows)
}
