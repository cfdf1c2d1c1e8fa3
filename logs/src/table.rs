//! The rows of the still poses as a table of text.

use std::fmt::Write;

use calibench::robot::{JointKind, Robot};
use calibench::units::UM;

use crate::log::{JointTrack, Track};
use crate::middle::{FEWEST_READINGS, Middle, Row};
use crate::windows::Still;

/// A motion is one if it is longer than this multiple of the tolerance at rest.
const MOTION: f64 = 3.0;

/// Titles of what is known of a row beside joints and measurement: its time, the number of readings, how they scatter, and the
/// one-sigma of their mean; the sign of the last motion of joint `i` is called `approach1` and so on.
pub(crate) const TIME: &str = "t_s";
/// See [`TIME`].
pub(crate) const READINGS: &str = "readings";
/// See [`TIME`].
pub(crate) const SCATTER: &str = "scatter_um";
/// See [`TIME`].
pub(crate) const SIGMA: &str = "sigma_um";
/// See [`TIME`].
pub(crate) const APPROACH: &str = "approach";

fn mean_of(joints: &JointTrack, still: &Still, j: usize) -> f64 {
    let width = joints.joints.len();
    (still.from..still.to).map(|k| joints.positions[k * width + j]).sum::<f64>() / (still.to - still.from) as f64
}

/// The mean position of each joint in a rest.
pub(crate) fn mean_posture(joints: &JointTrack, still: &Still) -> Vec<f64> {
    (0..joints.joints.len()).map(|j| mean_of(joints, still, j)).collect()
}

/// The arm over time.
pub(crate) struct Arm<'a> {
    pub robot: &'a Robot,
    pub joints: &'a JointTrack,
    pub times: &'a [f64],
    pub tolerance: &'a [f64],
}

impl Arm<'_> {
    fn position(&self, row: usize, j: usize) -> f64 {
        self.joints.positions[row * self.joints.joints.len() + j]
    }

    /// The sign of the last motion of a joint to where it is, seen in the readings before one; 0 if it had not moved.
    pub fn approach(&self, before: usize, j: usize, at: f64) -> i8 {
        let moved = |k: &usize| (self.position(*k, j) - at).abs() > MOTION * self.tolerance[j];
        match (0..before).rev().find(moved) {
            Some(k) if self.position(k, j) < at => 1,
            Some(_) => -1,
            None => 0,
        }
    }
}

/// The rows of a log, as fields of text.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fields {
    /// Titles of joints and measurements.
    pub titles: Vec<String>,
    /// Titles of what is known of each row beside.
    pub beside: Vec<String>,
    /// For each row the fields of both.
    pub rows: Vec<Vec<String>>,
}

impl Fields {
    /// As a table; without what is known beside if `all` is false.
    pub fn csv(&self, all: bool) -> String {
        let count = self.titles.len() + if all { self.beside.len() } else { 0 };
        let titles: Vec<String> = self.titles.iter().chain(&self.beside).cloned().collect();
        std::iter::once(&titles).chain(&self.rows).map(|row| csv_line(&row[..count])).collect()
    }
}

/// A row of the table: where the arm was, and what was measured then.
pub(crate) struct TableRow<'a> {
    /// Position of each joint, rad or m.
    pub posture: Vec<f64>,
    /// Time since the begin of the log, s.
    pub time: f64,
    /// Sign of the last motion of each joint.
    pub approach: Vec<i8>,
    /// Of each track.
    pub middles: &'a [Option<Middle>],
    /// One-sigma of the mean of the readings, m, where it is not that of their scatter.
    pub of_mean: Option<f64>,
}

impl<'a> TableRow<'a> {
    /// That of a rest.
    pub fn of_rest(arm: &Arm<'_>, row: &'a Row) -> Self {
        let still = &row.still;
        let posture = mean_posture(arm.joints, still);
        let begin = arm.times.first().copied().unwrap_or(0.0);
        let approach = posture.iter().enumerate().map(|(j, &at)| arm.approach(still.from, j, at)).collect();
        TableRow { posture, time: arm.times[still.from] - begin, approach, middles: &row.middles, of_mean: None }
    }
}

/// The rows, with the one-sigma of each where that of the instrument is given, m.
pub(crate) fn fields(arm: &Arm<'_>, tracks: &[&Track], kept: &[TableRow<'_>], noise: Option<f64>) -> Fields {
    let joints = arm.joints.joints.len();
    let title = |j: usize| match (arm.joints.is_si, arm.robot.kind(j)) {
        (true, JointKind::Revolute) => format!("q{}_rad", j + 1),
        (true, JointKind::Prismatic) => format!("q{}_m", j + 1),
        (false, _) => format!("q{}", j + 1),
    };
    let mut titles: Vec<String> = (0..joints).map(title).collect();
    for (n, track) in tracks.iter().enumerate() {
        // Points of one tool are numbered; an orientation is that of the first.
        let of = track.titles.iter().filter(|title| n == 0 || !title.starts_with('q'));
        titles.extend(of.map(|title| match title.split_once('_') {
            Some((axis, unit)) if tracks.len() > 1 && axis.len() == 1 => format!("{axis}{}_{unit}", n + 1),
            _ => title.clone(),
        }));
    }
    let in_metres = tracks.first().and_then(|track| track.titles.first()).is_some_and(|title| title == "x_m");
    let mut beside = vec![TIME.to_owned(), READINGS.into()];
    beside.extend(in_metres.then(|| SCATTER.to_owned()));
    beside.extend(noise.filter(|_| in_metres).map(|_| SIGMA.to_owned()));
    beside.extend((0..joints).map(|j| format!("{APPROACH}{}", j + 1)));
    let row = |TableRow { posture, time, approach, middles, of_mean }: &TableRow<'_>| {
        let mut fields: Vec<String> = posture.iter().map(|&at| written(at)).collect();
        for (n, (track, middle)) in tracks.iter().zip(*middles).enumerate() {
            for (c, title) in track.titles.iter().enumerate() {
                if n == 0 || !title.starts_with('q') {
                    fields.push(middle.as_ref().map_or_else(String::new, |middle| written(middle.values[c])));
                }
            }
        }
        fields.push(written(*time));
        let first = middles.first().and_then(Option::as_ref);
        let readings = first.map_or(0, |middle| middle.readings);
        fields.push(readings.to_string());
        let known = first.filter(|middle| middle.readings >= FEWEST_READINGS);
        let scatter = known.map(|m| (m.scatter[..3.min(m.scatter.len())].iter().map(|s| s * s).sum::<f64>() / 3.0).sqrt());
        if in_metres {
            fields.push(scatter.map_or_else(String::new, micrometres));
        }
        if let Some(noise) = noise.filter(|_| in_metres) {
            let of_mean = of_mean.unwrap_or_else(|| scatter.unwrap_or(0.0) / (readings.max(1) as f64).sqrt());
            fields.push(micrometres(noise.hypot(of_mean)));
        }
        fields.extend(approach.iter().map(i8::to_string));
        fields
    };
    Fields { titles, beside, rows: kept.iter().map(row).collect() }
}

fn micrometres(length: f64) -> String {
    format!("{:.3}", length / UM)
}

fn written(value: f64) -> String {
    if value.is_finite() { value.to_string() } else { String::new() }
}

fn csv_line(fields: &[String]) -> String {
    let mut line = String::new();
    for (k, field) in fields.iter().enumerate() {
        let quoted = field.contains([',', '"', '\n', '\r']);
        let comma = if k > 0 { "," } else { "" };
        _ = if quoted { write!(line, "{comma}\"{}\"", field.replace('"', "\"\"")) } else { write!(line, "{comma}{field}") };
    }
    line + "\n"
}
