//! Logs in place of a table: the flags that say what of a log is meant, and the table of its rows.

use std::path::{Path, PathBuf};

use calibench::files::disk::is_file;
use calibench::robot::robot_file::{RobotReference, robot};
use calibench::robot::urdf::robot_from_urdf;
use calibench_logs::{JointChoice, LogOptions, LogTable, log_table, read_logs};

use crate::arguments::data::from_anywhere;
use crate::arguments::quantities::{duration, signed_duration};
use crate::terminal::failure::Failure;

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
    /// Use what was measured while the arm moved: joints and instrument are compared at the same moments, by the delay between them
    #[arg(long, conflicts_with_all = ["still", "settle"])]
    pub moving: bool,
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
            (self.moving, "--moving"),
            (self.still.is_some(), "--still"),
            (self.settle.is_some(), "--settle"),
            (self.shift.is_some(), "--shift"),
        ];
        all.into_iter().find(|(given, _)| *given).map(|(_, flag)| flag)
    }
}

/// Reads logs and finds how their rows fit the robot. The table is written to `folder`, from where it is read.
pub fn table(
    files: &[PathBuf],
    named: &str,
    arguments: &LogArguments,
    noise: Option<f64>,
    folder: &Path,
) -> Result<LogTable, Failure> {
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
    let defaults = LogOptions::default();
    let options = LogOptions {
        joints: JointChoice { names, topic: arguments.joints_from.clone() },
        measured: arguments.measured.clone(),
        shortest: arguments.still.unwrap_or(defaults.shortest),
        settling: arguments.settle.unwrap_or(defaults.settling),
        shift: arguments.shift,
        own_frames,
        noise,
        moving: arguments.moving,
    };
    Ok(log_table(&log, &arm, &from_anywhere(named), &options, folder)?)
}
