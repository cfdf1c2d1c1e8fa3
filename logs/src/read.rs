//! Which files are logs, and reading them by their kind.

use std::path::{Path, PathBuf};

use calibench::files::FileError;
use calibench::robot::Robot;

use crate::error::LogError;
use crate::log::Log;
use crate::ros_bag::{files_of_bag, is_recording};
use crate::{ros_bag, table_over_time};

/// True of an MCAP file or a bag by its name, or by what a folder holds; a table over time looks like any table.
pub fn is_log(path: &Path) -> bool {
    is_recording(path) || path.is_dir() && files_of_bag(path).is_some_and(|files| !files.is_empty())
}

/// Reads the files of one recording: MCAP files, ROS 2 bags (folders or files), and tables of text with a time in every row.
/// Tracks of one topic are one. Names of joints in a table are recognised by those of the robot, if they are given.
///
/// # Errors
/// If a file cannot be read, or is of no such kind.
pub fn read_logs(paths: &[PathBuf], robot: &Robot, joint_names: &[String]) -> Result<Log, LogError> {
    let mut log = Log::default();
    for path in paths {
        let files = if path.is_dir() {
            let files = files_of_bag(path).filter(|files| !files.is_empty());
            files.ok_or_else(|| {
                FileError::whole(path, "holds no recording", "give a bag with .db3 or .mcap files, or name a file")
            })?
        } else {
            vec![path.clone()]
        };
        for file in files {
            let part = read_one(&file, robot, joint_names)?;
            log.append(Log { files: vec![file], ..part });
        }
    }
    Ok(log)
}

fn read_one(file: &Path, robot: &Robot, joint_names: &[String]) -> Result<Log, FileError> {
    if is_recording(file) {
        return ros_bag::read(file);
    }
    let is_ros1 = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bag"));
    if is_ros1 {
        let remedy = "convert it: `pip install rosbags`, then `rosbags-convert --src FILE.bag --dst FOLDER`";
        return Err(FileError::whole(file, "is a bag of ROS 1", remedy));
    }
    table_over_time::read(file, robot, joint_names)
}
