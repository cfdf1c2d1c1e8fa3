//! Logs in place of a table: the flags that say what of a log is meant, and the table of its still poses.

use std::path::{Path, PathBuf};

use calibench::files::FileError;
use calibench::files::disk::{is_file, write_whole};
use calibench::import::{Guess, ImportError, guess};
use calibench::robot::robot_file::{RobotReference, robot};
use calibench::robot::urdf::robot_from_urdf;
use calibench_logs::{Excluded, JointChoice, StillOptions, read_logs, still_poses};

use crate::arguments::data::from_anywhere;
use crate::arguments::quantities::{duration, signed_duration};
use crate::terminal::failure::Failure;

/// The table of the still poses, in the folder of the dataset that is made of it.
pub const STILLS: &str = "stills.csv";

/// Beginnings of the reasons of a guess that a log does not make plain.
const TOLD: [&str; 2] = ["orientations: ", "an orientation"];

/// What of a log is meant.
#[derive(clap::Args, Debug, Clone, Default)]
#[command(next_help_heading = "Logs (MCAP, ROS 2 bags)")]
pub struct LogArguments {
    /// What was measured, by the name that the log gives it; repeat it for several points of one tool
    #[arg(long, value_name = "TOPIC")]
    measured: Vec<String>,
    /// Topic of the joints, if several hold them
    #[arg(long, value_name = "TOPIC")]
    joints_from: Option<String>,
    /// Names of the robot's joints from its base on, separated by commas, if the URDF does not tell them
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    joints: Vec<String>,
    /// Shortest rest after settling, such as 0.5s, which is the default
    #[arg(long, value_name = "TIME", value_parser = duration)]
    still: Option<f64>,
    /// Time after a motion in which nothing is taken, such as 0.3s, which is the default
    #[arg(long, value_name = "TIME", value_parser = duration)]
    settle: Option<f64>,
    /// Time to be added to that of the instrument, such as -0.12s; it is found from the motions if it is not given
    #[arg(long, value_name = "TIME", value_parser = signed_duration, allow_hyphen_values = true)]
    shift: Option<f64>,
}

impl LogArguments {
    /// The first flag that was given, which only a log takes.
    pub fn given(&self) -> Option<&'static str> {
        let all = [
            (!self.measured.is_empty(), "--measured"),
            (self.joints_from.is_some(), "--joints-from"),
            (!self.joints.is_empty(), "--joints"),
            (self.still.is_some(), "--still"),
            (self.settle.is_some(), "--settle"),
            (self.shift.is_some(), "--shift"),
        ];
        all.into_iter().find(|(given, _)| *given).map(|(_, flag)| flag)
    }
}

/// The still poses of a log as a table that was understood.
pub struct StillTable {
    /// The table, whole.
    pub text: String,
    /// How it is read.
    pub guess: Guess,
    /// What was understood of the log, a sentence each.
    pub said: Vec<String>,
    /// Number of rows.
    pub rows: usize,
    /// Rests that give no row.
    pub excluded: Vec<Excluded>,
    /// Time added to those of the instrument, s.
    pub shift_s: f64,
}

/// Reads logs, averages the rests, and finds how the numbers fit the robot. The table is written to `folder`, from where it is read.
pub fn still_table(
    files: &[PathBuf],
    named: &str,
    arguments: &LogArguments,
    noise: Option<f64>,
    folder: &Path,
) -> Result<StillTable, Failure> {
    let arm = robot(named, Path::new(""))?;
    let RobotReference { name, ends } = RobotReference::parse(named);
    let is_urdf = is_file(Path::new(name)) && Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("urdf"));
    let (of_urdf, own_frames) = match is_urdf {
        true => robot_from_urdf(Path::new(name), &ends).map(|urdf| (urdf.joint_names, urdf.links))?,
        false => Default::default(),
    };
    let names = if arguments.joints.is_empty() { of_urdf } else { arguments.joints.clone() };
    if !names.is_empty() && names.len() != arm.joints() {
        let (given, wanted) = (names.len(), arm.joints());
        return Err(format!("--joints: has {given} names, and '{}' has {wanted} joints; name them all", arm.name).into());
    }
    let log = read_logs(files, &arm, &names)?;
    let defaults = StillOptions::default();
    let options = StillOptions {
        joints: JointChoice { names, topic: arguments.joints_from.clone() },
        measured: arguments.measured.clone(),
        shortest: arguments.still.unwrap_or(defaults.shortest),
        settling: arguments.settle.unwrap_or(defaults.settling),
        shift: arguments.shift,
        own_frames,
        noise,
    };
    let stills = still_poses(&log, &arm, &options)?;
    let table = folder.join(STILLS);
    // What is known beside is no candidate for a joint or a position.
    write_whole(&table, stills.table().as_bytes())?;
    let understood = stills.said.last().cloned().unwrap_or_default();
    let of_log = |error: ImportError| match error {
        ImportError::File(error) if error.path == table => {
            let problem = format!("{understood}; the table of these rests {}", error.problem);
            let remedy = "check that it is this robot (--joints), what was measured (--measured), in rad and m, and the clocks (--shift)";
            ImportError::File(FileError { path: files[0].clone(), line: None, problem, remedy: remedy.into(), ..error })
        }
        error => error,
    };
    let guess = guess(&table, &arm, &from_anywhere(named)).map_err(of_log)?.with_columns(&stills.map_lines());
    let text = stills.whole_table();
    write_whole(&table, text.as_bytes())?;
    let mut said: Vec<String> = log.remarks.iter().chain(&stills.said).cloned().collect();
    for (n, name) in stills.measured().iter().enumerate().skip(1) {
        if !guess.map.contains(&format!("\"x{}_m\"", n + 1)) {
            said.push(format!(
                "{name} is not used: it does not move as a further point of the tool of {}",
                stills.measured()[0]
            ));
        }
    }
    // Of the columns, what is not plain from their titles.
    said.extend(guess.reasons.iter().filter(|reason| TOLD.iter().any(|begin| reason.starts_with(begin))).cloned());
    Ok(StillTable { text, guess, said, rows: stills.rows, excluded: stills.excluded, shift_s: stills.shift_s })
}
