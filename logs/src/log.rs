//! What a log holds.

use std::path::PathBuf;

/// Positions of joints over time, as one topic or table states them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointTrack {
    /// Topic, or file of the table.
    pub name: String,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// When the positions were read, s.
    pub times: Times,
    /// Positions, a row for each time, rad or m (in the unit of a table until [`is_si`](JointTrack::is_si)).
    pub positions: Vec<f64>,
    /// True if the positions are in SI units; a table may not say in which its are.
    pub is_si: bool,
    /// Number of the recording: what is of one was stamped by one clock, perhaps.
    pub recording: usize,
}

/// Measured numbers over time: a point, a pose, or the columns of a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Track {
    /// Topic with the name of the frame, marker or field; or file of the table.
    pub name: String,
    /// Titles of the numbers, with their units where they are known.
    pub titles: Vec<String>,
    /// When they were measured, s.
    pub times: Times,
    /// The numbers, a row for each time.
    pub values: Vec<f64>,
    /// Number of the recording.
    pub recording: usize,
}

/// Times of the rows of a track, s: those that the sender stated, and those of the recorder.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Times {
    /// As stated with the data; the recorder's where nothing is stated.
    pub stated: Vec<f64>,
    /// Of the recorder.
    pub recorded: Vec<f64>,
}

/// Joints and measurements of one or more files.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Log {
    /// The files.
    pub files: Vec<PathBuf>,
    /// Topics of joints.
    pub joints: Vec<JointTrack>,
    /// Topics of what was measured.
    pub tracks: Vec<Track>,
    /// Topics that hold neither, and those that cannot be read, with the reason.
    pub other: Vec<String>,
    /// What was not read as it is written, a sentence each.
    pub remarks: Vec<String>,
}

impl Times {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.stated.len()
    }

    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.stated.is_empty()
    }

    pub(crate) fn push(&mut self, stated: f64, recorded: f64) {
        self.stated.push(stated);
        self.recorded.push(recorded);
    }
}

impl JointTrack {
    /// Adds the positions of all joints at a time.
    pub(crate) fn push(&mut self, stated: f64, recorded: f64, positions: &[f64]) {
        self.times.push(stated, recorded);
        self.positions.extend_from_slice(positions);
    }
}

impl Track {
    /// Leaves out an orientation that never changes: a marker without one is written so.
    pub(crate) fn without_constant_orientation(&mut self) {
        let width = self.titles.len();
        let Some(at) = self.titles.iter().position(|title| title == "qx") else { return };
        let of = |row: &[f64]| row[at..].to_vec();
        let mut rows = self.values.chunks_exact(width);
        let first = rows.next().map(of);
        if rows.all(|row| Some(of(row)) == first) {
            self.values = self.values.chunks_exact(width).flat_map(|row| row[..at].to_vec()).collect();
            self.titles.truncate(at);
        }
    }

    /// Adds a row.
    pub(crate) fn push(&mut self, stated: f64, recorded: f64, values: &[f64]) {
        self.times.push(stated, recorded);
        self.values.extend_from_slice(values);
    }
}

impl Log {
    /// Adds what another file of the same log holds: tracks of one name are one.
    pub(crate) fn append(&mut self, other: Log) {
        for track in other.joints {
            match self.joints.iter_mut().find(|known| known.name == track.name && known.joints == track.joints) {
                Some(known) => {
                    known.times.stated.extend(track.times.stated);
                    known.times.recorded.extend(track.times.recorded);
                    known.positions.extend(track.positions);
                }
                None => self.joints.push(track),
            }
        }
        for track in other.tracks {
            match self.tracks.iter_mut().find(|known| known.name == track.name && known.titles == track.titles) {
                Some(known) => {
                    known.times.stated.extend(track.times.stated);
                    known.times.recorded.extend(track.times.recorded);
                    known.values.extend(track.values);
                }
                None => self.tracks.push(track),
            }
        }
        for topic in other.other {
            if !self.other.contains(&topic) {
                self.other.push(topic);
            }
        }
        self.files.extend(other.files);
        self.remarks.extend(other.remarks);
    }

    /// Adds joints read at a time to the track of their topic.
    pub(crate) fn push_joints(&mut self, topic: &str, names: Vec<String>, stated: f64, recorded: f64, positions: &[f64]) {
        let found = self.joints.iter().position(|track| track.name == topic && track.joints == names);
        let k = found.unwrap_or_else(|| {
            self.joints.push(JointTrack { name: topic.into(), joints: names, is_si: true, ..JointTrack::default() });
            self.joints.len() - 1
        });
        self.joints[k].push(stated, recorded, positions);
    }

    /// Adds a place seen at a time to the track of its name.
    pub(crate) fn push_place(&mut self, name: &str, titles: &[&str], stated: f64, recorded: f64, values: &[f64]) {
        let found = self.tracks.iter().position(|track| track.name == name && track.titles.len() == titles.len());
        let k = found.unwrap_or_else(|| {
            let titles = titles.iter().map(|&title| title.to_owned()).collect();
            self.tracks.push(Track { name: name.into(), titles, ..Track::default() });
            self.tracks.len() - 1
        });
        self.tracks[k].push(stated, recorded, values);
    }
}
