//! Which files are logs, and reading them by their kind.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use calibench::files::{FileError, cannot_be_read};
use calibench::robot::Robot;

use crate::error::LogError;
use crate::log::{Log, Track};
use crate::ros_bag::{files_of_bag, is_recording};
use crate::{mcap_file, ros_bag, table_over_time};

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
    for (recording, path) in paths.iter().enumerate() {
        let files = if path.is_dir() {
            let files = files_of_bag(path).filter(|files| !files.is_empty());
            files.ok_or_else(|| {
                FileError::whole(path, "holds no recording", "give a bag with .db3 or .mcap files, or name a file")
            })?
        } else {
            vec![path.clone()]
        };
        for file in files {
            let mut part = read_one(&file, robot, joint_names)?;
            part.joints.iter_mut().for_each(|track| track.recording = recording);
            part.tracks.iter_mut().for_each(|track| track.recording = recording);
            log.append(Log { files: vec![file], ..part });
        }
    }
    log.tracks.iter_mut().for_each(Track::without_constant_orientation);
    Ok(log)
}

/// First bytes of a database of SQLite, and of a bag of ROS 1.
const BEGINS: [&[u8]; 2] = [b"SQLite format 3\0", b"#ROSBAG"];

fn read_one(file: &Path, robot: &Robot, joint_names: &[String]) -> Result<Log, FileError> {
    let mut head = Vec::new();
    let opened = File::open(file).map_err(|e| cannot_be_read(file, e))?;
    opened.take(64).read_to_end(&mut head).map_err(|e| cannot_be_read(file, e))?;
    // What a file is says its beginning, whatever its name.
    if head.starts_with(mcap::MAGIC) {
        return mcap_file::read(file, File::open(file).map_err(|e| cannot_be_read(file, e))?);
    }
    if is_recording(file) || head.starts_with(BEGINS[0]) {
        return ros_bag::read(file);
    }
    if head.starts_with(BEGINS[1]) {
        let remedy = "convert it: `pip install rosbags`, then `rosbags-convert --src FILE.bag --dst FOLDER`";
        return Err(FileError::whole(file, "is a bag of ROS 1", remedy));
    }
    table_over_time::read(file, robot, joint_names)
}
