//! The progress of a campaign, from the files in its folder: the centring of every ball, reading by reading.

use std::path::Path;

use serde_json::{Value, json};

use super::short;
use calibench::files::FileError;
use calibench::files::csv_table::CsvTable;

/// The remedy given for a malformed file.
const REMEDY: &str = "give the file as `calibench run` wrote it";

/// One attempt at centring on a ball.
#[derive(Debug, Clone, PartialEq)]
pub struct CentringRecord {
    /// Id of the planned pose.
    pub id: String,
    /// Name of the ball.
    pub ball: String,
    /// `centred`, or the name of the failure.
    pub outcome: String,
    /// Duration, s.
    pub duration_s: f64,
    /// Least clearance on the planned path to the pose, mm, if known.
    pub clearance_mm: Option<f64>,
    /// Norm of the indicator readings at every stop on the ball, um: the remaining centring error.
    pub readings_um: Vec<f64>,
}

/// All attempts of a campaign, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignRecord {
    /// The attempts.
    pub centrings: Vec<CentringRecord>,
}

impl CampaignRecord {
    /// Reads `probings.csv` and `iterations.csv` from a folder; `None` if it holds neither.
    ///
    /// # Errors
    /// An error that names file, line, column and remedy.
    pub fn read(folder: &Path) -> Result<Option<Self>, FileError> {
        let [probings, stops] = ["probings.csv", "iterations.csv"].map(|name| folder.join(name));
        if !probings.is_file() || !stops.is_file() {
            return Ok(None);
        }
        let mut centrings = Vec::new();
        let table = CsvTable::read(&probings, &["id", "ball", "outcome", "duration_s"], REMEDY)?;
        let knows_clearance = table.has("clearance_mm");
        for row in table.rows() {
            centrings.push(CentringRecord {
                id: row.text("id").into(),
                ball: row.text("ball").into(),
                outcome: row.text("outcome").into(),
                duration_s: row.number("duration_s")?.unwrap_or_default(),
                clearance_mm: if knows_clearance { row.number("clearance_mm")? } else { None },
                readings_um: Vec::new(),
            });
        }
        let [x, y, z] = ["r1_um", "r2_um", "r3_um"];
        for row in CsvTable::read(&stops, &["probing", "phase", x, y, z], REMEDY)?.rows() {
            let probing = row.text("probing");
            let centring = probing.parse::<usize>().ok().and_then(|k| centrings.get_mut(k.checked_sub(1)?));
            let centring = centring.ok_or_else(|| row.wrong("probing", format!("'{probing}' is not a row of probings.csv")))?;
            if row.text("phase") != "centring" {
                continue;
            }
            let length = row.three([x, y, z])?.map(|[x, y, z]| (x * x + y * y + z * z).sqrt());
            centring.readings_um.extend(length);
        }
        Ok(Some(CampaignRecord { centrings }))
    }

    pub(super) fn json(&self) -> Value {
        self.centrings
            .iter()
            .map(|c| {
                json!({"id": c.id, "ball": c.ball, "outcome": c.outcome, "duration_s": short(c.duration_s), "clearance_mm": c.clearance_mm.map(short),
                    "readings_um": super::shorts(c.readings_um.iter().copied())})
            })
            .collect()
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
        assert_eq!(record.centrings[0].clearance_mm, None);
        write("probings.csv", "id,ball,outcome,duration_s,clearance_mm\np1,A,centred,12.5,3.4\n");
        let record = CampaignRecord::read(folder.path()).expect("readable").expect("there");
        assert_eq!(record.centrings[0].clearance_mm, Some(3.4));
        write("iterations.csv", "probing,phase,r1_um,r2_um,r3_um\n2,centring,3,4,12\n");
        let error = CampaignRecord::read(folder.path()).expect_err("no such probing").to_string();
        assert!(error.contains("iterations.csv:2: probing: '2'"), "{error}");
    }
}
