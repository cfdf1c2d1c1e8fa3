//! A log as a table that is understood: its rows, and how their columns fit the robot.

use std::path::Path;

use calibench::files::FileError;
use calibench::files::disk::write_whole;
use calibench::import::{Guess, ImportError, ImportOptions, guess};
use calibench::measure::dataset::Dataset;
use calibench::robot::Robot;

use crate::error::LogError;
use crate::log::Log;
use crate::moving::Moving;
use crate::poses::{Excluded, MeasuredPoses};
use crate::still_poses::{LogOptions, still_poses};

/// File of the table of rests.
pub const STILLS: &str = "stills.csv";
/// File of the table of moments in motion.
pub const MOMENTS: &str = "moments.csv";

/// Beginnings of the reasons of a guess that a log does not make plain.
const TOLD: [&str; 2] = ["orientations: ", "an orientation"];

/// A log as a table that was understood.
pub struct LogTable {
    /// The table, whole.
    pub text: String,
    /// Name of its file.
    pub file: &'static str,
    /// How it is read.
    pub guess: Guess,
    /// What was understood of the log, a sentence each.
    pub said: Vec<String>,
    /// Number of rows.
    pub rows: usize,
    /// Intervals that give no row.
    pub excluded: Vec<Excluded>,
    /// Time added to those of the instrument, s.
    pub shift_s: f64,
    /// Standard uncertainty of that, s, where it was found from motion.
    pub shift_sigma_s: Option<f64>,
}

/// Averages the rests of a log, or takes what was measured in motion, and finds how the numbers fit the robot, which maps name by
/// `reference`. The table is written to `folder`, from where it is read.
///
/// # Errors
/// As [`still_poses`] and [`Moving::of`]; and if the columns do not fit the robot.
pub fn log_table(log: &Log, robot: &Robot, reference: &str, options: &LogOptions, folder: &Path) -> Result<LogTable, LogError> {
    let mut moving = options.moving.then(|| Moving::of(log, robot, options)).transpose()?;
    let mut poses = match &moving {
        Some(moving) => moving.poses(),
        None => still_poses(log, robot, options)?,
    };
    let file = if options.moving { MOMENTS } else { STILLS };
    let table = folder.join(file);
    // What is known beside is no candidate for a joint or a position.
    write_whole(&table, poses.table().as_bytes())?;
    let understood = poses.said.last().cloned().unwrap_or_default();
    let of_log = |error: ImportError| match error {
        ImportError::File(error) if error.path == table => {
            let problem = format!("{understood}; the table of these {}", error.problem);
            let remedy = "check that it is this robot (--joints), what was measured (--measured), in rad and m, and the clocks (--shift)";
            let path = log.files.first().cloned().unwrap_or_default();
            ImportError::File(FileError { path, line: None, problem, remedy: remedy.into(), ..error })
        }
        error => error,
    };
    let guess = guess(&table, robot, reference).map_err(of_log)?.with_columns(&poses.map_lines());
    let write = |poses: &MeasuredPoses| -> Result<String, LogError> {
        let text = poses.whole_table();
        write_whole(&table, text.as_bytes())?;
        Ok(text)
    };
    let mut text = write(&poses)?;
    if let Some(moving) = &mut moving {
        let read = || -> Result<Dataset, ImportError> {
            Ok(guess.import(std::slice::from_ref(&table), &ImportOptions::default()).map_err(of_log)?.0)
        };
        while !moving.refine(&read()?) {
            write(&moving.poses())?;
        }
        poses = moving.poses();
        text = write(&poses)?;
    }
    let mut said: Vec<String> = log.remarks.iter().chain(&poses.said).cloned().collect();
    for (n, name) in poses.measured().iter().enumerate().skip(1) {
        if !guess.map.contains(&format!("\"x{}_m\"", n + 1)) {
            said.push(format!(
                "{name} is not used: it does not move as a further point of the tool of {}",
                poses.measured()[0]
            ));
        }
    }
    // Of the columns, what is not plain from their titles.
    said.extend(guess.reasons.iter().filter(|reason| TOLD.iter().any(|begin| reason.starts_with(begin))).cloned());
    let MeasuredPoses { rows, excluded, shift_s, .. } = poses;
    let shift_sigma_s = moving.as_ref().map(Moving::shift_sigma);
    Ok(LogTable { text, file, guess, said, rows, excluded, shift_s, shift_sigma_s })
}
