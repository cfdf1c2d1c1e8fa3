//! The rows of a campaign's `iterations.csv`, read for replay.

use std::path::Path;

use nalgebra::Vector3;

use super::{IndicatorError, ManipulatorError};
use crate::files::FileError;
use crate::files::csv_table::{CsvRow, CsvTable};
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

/// A device's answer in place of a result.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Fault {
    Indicator(usize, IndicatorError),
    Robot(ManipulatorError),
    /// It reported a motion, but its joints were elsewhere.
    StoodStill,
}

/// Reads the stops of a recorded campaign.
pub(super) fn read_stops(path: &Path) -> Result<Vec<Stop>, FileError> {
    let columns = ["time_s", "fault", "q1_deg"].into_iter().chain(READING).chain(STEP).collect::<Vec<_>>();
    let table = CsvTable::read(path, &columns, "give the iterations.csv of a campaign")?;
    let angles: Vec<String> = (1..).map(|j| format!("q{j}_deg")).take_while(|column| table.has(column)).collect();
    let number = |row: CsvRow<'_>, column: &str| row.number(column).map_err(a_number_or_nothing);
    let vector = |row: CsvRow<'_>, columns| {
        row.three(columns).map(|three| three.map(|v| Vector3::from(v) * UM)).map_err(a_number_or_nothing)
    };
    let stop = |row: CsvRow<'_>| {
        let mut joints = Vec::with_capacity(angles.len());
        for column in &angles {
            joints.extend(number(row, column)?.map(|q| q * DEG));
        }
        Ok(Stop {
            time_s: number(row, "time_s")?.unwrap_or_default(),
            joints,
            reading: vector(row, READING)?,
            step: vector(row, STEP)?,
            fault: fault(row, angles.len())?,
        })
    };
    table.rows().map(stop).collect()
}

/// The columns of a reading and of a step.
const READING: [&str; 3] = ["r1_um", "r2_um", "r3_um"];
const STEP: [&str; 3] = ["step1_um", "step2_um", "step3_um"];

fn a_number_or_nothing(error: FileError) -> FileError {
    FileError { remedy: "write a number, or leave the field empty".into(), ..error }
}

/// The device's answer behind a recorded failure; conclusions that the controller drew from readings are drawn again in the
/// replay.
fn fault(row: CsvRow<'_>, joints: usize) -> Result<Option<Fault>, FileError> {
    let text = row.text("fault");
    let (name, place) = text.split_once(':').unwrap_or((text, ""));
    let counted = |of: usize| match place.parse::<usize>() {
        Ok(place) if (1..=of).contains(&place) => Ok(place),
        _ => Err(FileError {
            remedy: "put its number after a colon".into(),
            ..row.wrong("fault", format!("'{text}' names no indicator or joint"))
        }),
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
        "collision" => robot(ManipulatorError::Collision { between: [as_recorded(), as_recorded()] }),
        "robot_refused" => robot(ManipulatorError::Refused { reason: as_recorded() }),
        "joint_limit" => robot(ManipulatorError::JointLimit { joint: counted(joints)? }),
        "robot_did_not_move" => Ok(Some(Fault::StoodStill)),
        "unreachable" => robot(ManipulatorError::Unreachable),
        _ => Ok(None),
    }
}
