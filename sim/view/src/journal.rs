//! The journal of a campaign: every stop of the arm, from `probings.csv` and `iterations.csv`.

use std::collections::BTreeSet;
use std::path::Path;

use calibench::files::FileError;
use calibench::files::csv_table::CsvTable;
use calibench::units::{DEG, UM};
use nalgebra::Vector3;

/// Remedy for a damaged file.
const REMEDY: &str = "give the file as `calibench run` wrote it";

/// One attempt at a ball.
#[derive(Debug, Clone, PartialEq)]
pub struct Try {
    /// Id of the planned pose, and of its sample.
    pub id: String,
    /// The ball.
    pub ball: String,
    /// `centred`, or the name of the failure.
    pub outcome: String,
    /// Least gap on the planned path to the pose, mm, if known.
    pub clearance_mm: Option<f64>,
}

/// One stop of the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// Its row of `iterations.csv`, counted from 0.
    pub row: usize,
    /// Index of its attempt.
    pub probing: usize,
    /// True if on the ball, rather than before it or back from it.
    pub on_ball: bool,
    /// Time since the session began, s.
    pub time_s: Option<f64>,
    /// Joints read back, rad (N).
    pub joints: Vec<f64>,
    /// Readings of the indicators, m: the ball's centre in the tool frame.
    pub reading: Option<Vector3<f64>>,
}

/// A campaign, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Journal {
    /// Its attempts.
    pub tries: Vec<Try>,
    /// Its stops.
    pub stops: Vec<Stop>,
    /// Number of rows of `iterations.csv`, including stops without known joints.
    pub rows: usize,
}

impl Journal {
    /// Reads the journal of an arm with this number of joints; `None` if the folder has none.
    ///
    /// # Errors
    /// When a column is missing, a value is not a number, a row belongs to no probing, or a probing has no row.
    pub fn read(folder: &Path, joints: usize) -> Result<Option<Self>, FileError> {
        let [probings, iterations] = ["probings.csv", "iterations.csv"].map(|name| folder.join(name));
        if !probings.is_file() || !iterations.is_file() {
            return Ok(None);
        }
        let mut journal = Journal::default();
        let table = CsvTable::read(&probings, &["id", "ball", "outcome"], REMEDY)?;
        let knows_clearance = table.has("clearance_mm");
        for row in table.rows() {
            let text = |column: &str| row.text(column).to_owned();
            let clearance_mm = if knows_clearance { row.number("clearance_mm")? } else { None };
            journal.tries.push(Try { id: text("id"), ball: text("ball"), outcome: text("outcome"), clearance_mm });
        }
        let mut seen = BTreeSet::new();
        let angles: Vec<String> = (1..=joints).map(|j| format!("q{j}_deg")).collect();
        let reading = ["r1_um", "r2_um", "r3_um"];
        let columns: Vec<&str> =
            ["probing", "phase", "time_s"].into_iter().chain(reading).chain(angles.iter().map(String::as_str)).collect();
        for row in CsvTable::read(&iterations, &columns, REMEDY)?.rows() {
            journal.rows += 1;
            let number = row.text("probing");
            let probing = number.parse::<usize>().ok().filter(|k| (1..=journal.tries.len()).contains(k));
            let probing = probing.ok_or_else(|| row.wrong("probing", format!("'{number}' is not a row of probings.csv")))?;
            seen.insert(probing - 1);
            let joints = angles.iter().map(|column| row.number(column)).collect::<Result<Option<Vec<f64>>, _>>()?;
            // A stop without known joints cannot be shown.
            let Some(joints) = joints else { continue };
            journal.stops.push(Stop {
                row: journal.rows - 1,
                probing: probing - 1,
                on_ball: row.text("phase") == "centring",
                time_s: row.number("time_s")?,
                joints: joints.into_iter().map(|q| q * DEG).collect(),
                reading: row.three(reading)?.map(|r| Vector3::from(r) * UM),
            });
        }
        match (0..journal.tries.len()).find(|probing| !seen.contains(probing)) {
            Some(missing) => {
                let problem = format!("has no row of probing {}, which probings.csv names", missing + 1);
                Err(FileError::whole(&iterations, problem, REMEDY))
            }
            None => Ok(Some(journal)),
        }
    }

    /// The stop at which an attempt is shown on the timeline of probings: the last on the ball, or else the last of all.
    pub fn settled(&self, probing: usize) -> Option<usize> {
        let of_it = |k: &usize| self.stops[*k].probing == probing;
        let last = |on_ball: bool| (0..self.stops.len()).rev().filter(of_it).find(|&k| !on_ball || self.stops[k].on_ball);
        last(true).or_else(|| last(false))
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
        assert!(error.contains("iterations.csv:2: probing: '2' is not a row"), "{error}");
    }

    #[test]
    fn a_journal_that_breaks_off_is_an_error() {
        let probings = "id,ball,outcome\np1,A,centred\np2,A,centred\n";
        let error = journal(probings, "1,approach,1,10,20,,,\n").unwrap_err().to_string();
        assert!(error.contains("iterations.csv: has no row of probing 2"), "{error}");
        assert!(journal(probings, "1,approach,1,10,20,,,\n2,appro").unwrap_err().to_string().contains("iterations.csv:3"));
    }
}
