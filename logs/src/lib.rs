//! Robot logs as measurements: where the arm stood still, and what an instrument or a camera saw there.
//!
//! A log holds the joints over time ([`JointTrack`]) and what was measured over time ([`Track`]): topics of an MCAP file or of a ROS 2
//! bag, or the columns of a table with a time in each row. [`read_logs`] reads them, [`still_poses`] finds the intervals in which no
//! joint moved, matches the clocks of joints and instrument, and averages each interval to one row of a table. [`Moving`] takes what was
//! measured in motion. [`log_table`] makes of either a table whose columns are understood.
//!
//! # Reading order
//!
//! `log` (what a log holds), `read` and its formats, `joints` (which topic, in which order), `windows` (when the arm stood still),
//! `clocks` (by how much two clocks differ), `still_poses` and `moving` (the rows), `log_table` (how the table is read).

mod clocks;
mod decoder;
mod definitions;
mod error;
mod geometry;
mod joints;
mod log;
mod log_table;
mod mcap_file;
mod middle;
mod moving;
mod poses;
mod read;
mod ros_bag;
mod series;
mod still_poses;
mod table;
mod table_over_time;
mod text_layout;
mod windows;

pub use error::LogError;
pub use joints::JointChoice;
pub use log::{JointTrack, Log, Times, Track};
pub use log_table::{LogTable, MOMENTS, STILLS, log_table};
pub use moving::Moving;
pub use poses::{Excluded, MeasuredPoses};
pub use read::{is_log, read_logs};
pub use still_poses::{LogOptions, still_poses};
