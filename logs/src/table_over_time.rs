//! Tables of text with a time in each row, as controllers, trackers and recorders of topics write them: RTDE of Universal Robots,
//! traces of KUKA, exports of a tracker's software.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use calibench::files::{FileError, cannot_be_read};
use calibench::robot::{JointKind, Robot};
use calibench::units::{DEG, MM};
use jiff::tz::TimeZone;
use jiff::{Unit, civil};

use crate::joints::{named, order};
use crate::log::{JointTrack, Log, Track};
use crate::series::period;
use crate::text_layout::{Text, layout};

/// Titles of the column of times, without units.
const TIMES: [&str; 12] =
    ["timestamp", "time", "t", "stamp", "secs", "seconds", "sec", "zeit", "datetime", "elapsed", "clock", "timecode"];
/// Units of times in a title, and seconds of them.
const UNITS: [(&str, f64); 7] =
    [("ns", 1e-9), ("us", 1e-6), ("µs", 1e-6), ("ms", 1e-3), ("sec", 1.0), ("s", 1.0), ("min", 60.0)];
/// Names of joints that differ in their number alone, the likeliest first.
const NUMBERED: [&str; 14] = [
    "actual_q",
    "q_actual",
    "actual_position",
    "q",
    "joint",
    "joint_angle",
    "joint_position",
    "j",
    "axis_act_a",
    "axis_act",
    "axis",
    "a",
    "theta",
    "pos",
];
/// Least times since 1970 in nanoseconds, microseconds and milliseconds: those of 1990.
const SINCE_1970: [(f64, f64); 3] = [(6.3e17, 1e-9), (6.3e14, 1e-6), (6.3e11, 1e-3)];
/// Share of a column that may be empty or no number, beyond which it is no measurement.
const EMPTY: f64 = 0.98;
/// Angles beyond this are not radians: joints turn twice at most.
const RADIANS: f64 = 2.0 * std::f64::consts::TAU;

/// Reads a table. A table without joints holds measurements alone, and one without other numbers joints alone.
pub(crate) fn read(path: &Path, robot: &Robot, joint_names: &[String]) -> Result<Log, FileError> {
    let open = || File::open(path).map_err(|e| cannot_be_read(path, e));
    let wrong = |problem: String, remedy: &str| FileError::whole(path, problem, remedy);
    let mut head = vec![0; Text::HEAD];
    let mut count = 0;
    let mut file = open()?;
    while count < head.len() {
        match file.read(&mut head[count..]).map_err(|e| cannot_be_read(path, e))? {
            0 => break,
            read => count += read,
        }
    }
    if head[..count].contains(&0) {
        let remedy = "give an MCAP file, a bag of ROS 2, or a table of text";
        return Err(wrong("is neither a recording nor text".into(), remedy));
    }
    let text = String::from_utf8_lossy(&head[..count]).into_owned();
    let Some(layout) = layout(&text) else {
        return Err(wrong("is no table with a line of titles".into(), "give a recording, or a table with a time in each row"));
    };
    let titles = layout.titles.clone();
    let Some(time) = titles.iter().position(|title| TIMES.contains(&without_unit(title).0.as_str())) else {
        let remedy = "name the column of times `time_s`; a table of still postures without times goes to `calibench calibrate`";
        return Err(wrong(format!("has no column of times; its columns are {}", named(&titles)), remedy));
    };
    let mut input = BufReader::new(open()?);
    for _ in 0..layout.skipped {
        input.skip_until(b'\n').map_err(|e| cannot_be_read(path, e))?;
    }
    let mut rows = csv::ReaderBuilder::new().delimiter(layout.delimiter).flexible(true).has_headers(true).from_reader(input);
    let number = |bytes: &[u8]| {
        let text = std::str::from_utf8(bytes).ok()?.trim();
        let text = if layout.comma { text.replace(',', ".") } else { text.to_owned() };
        text.parse::<f64>().ok().filter(|v| v.is_finite())
    };
    let mut times = Vec::new();
    let mut values = Vec::new();
    let mut record = csv::ByteRecord::new();
    let mut are_dates = false;
    let mut without_time = 0usize;
    let mut first_text = None;
    while rows
        .read_byte_record(&mut record)
        .map_err(|e| wrong(format!("cannot be read: {e}"), "write it as a table of text"))?
    {
        let date = || record.get(time).and_then(|text| date(std::str::from_utf8(text).ok()?)).inspect(|_| are_dates = true);
        let Some(at) = record.get(time).and_then(number).or_else(date) else {
            without_time += 1;
            first_text.get_or_insert_with(|| {
                (
                    record.position().map_or(0, csv::Position::line) + layout.skipped as u64,
                    String::from_utf8_lossy(record.get(time).unwrap_or_default()).into_owned(),
                )
            });
            continue;
        };
        times.push(at);
        values.extend((0..titles.len()).map(|k| record.get(k).and_then(number).unwrap_or(f64::NAN)));
    }
    if times.is_empty() {
        let (line, text) = first_text.unwrap_or_default();
        let mut error = wrong(format!("no time of '{text}' is a number"), "write times in seconds");
        (error.line, error.field) = (usize::try_from(line).ok().filter(|line| *line > 0), titles[time].clone());
        return Err(error);
    }
    let second = if are_dates { 1.0 } else { seconds(&titles[time], &times) };
    times.iter_mut().for_each(|t| *t *= second);
    let of_joints = joint_columns(&titles, robot, joint_names);
    let mut log = Log::default();
    if without_time > 0 {
        log.remarks.push(format!("{}: {without_time} rows without a time are not used", path.display()));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let width = titles.len();
    if let Some(columns) = &of_joints {
        log.joints.push(joints(&name, &titles, columns, robot, &Rows { times: &times, values: &values, width }));
    }
    let is_empty = |k: usize| {
        let missing = values.iter().skip(k).step_by(width).filter(|v| v.is_nan()).count();
        missing as f64 > EMPTY * times.len() as f64
    };
    let is_joint = |k: usize| of_joints.as_ref().is_some_and(|columns| columns.contains(&k));
    let free: Vec<usize> = (0..width).filter(|&k| k != time && !is_joint(k) && !is_empty(k)).collect();
    if !free.is_empty() {
        let mut track = Track { name, titles: free.iter().map(|&k| titles[k].clone()).collect(), ..Track::default() };
        for (row, t) in values.chunks_exact(width).zip(&times) {
            let row: Vec<f64> = free.iter().map(|&k| row[k]).collect();
            // A point that was not seen is empty, or written as zeros.
            if row.iter().any(|v| v.is_finite() && *v != 0.0) {
                track.push(*t, *t, &row);
            }
        }
        log.tracks.push(track);
    }
    Ok(log)
}

/// The numbers of a table.
struct Rows<'a> {
    times: &'a [f64],
    values: &'a [f64],
    width: usize,
}

fn joints(name: &str, titles: &[String], columns: &[usize], robot: &Robot, rows: &Rows<'_>) -> JointTrack {
    let units: Vec<Option<f64>> = columns.iter().map(|&k| unit_of(&titles[k])).collect();
    let turns = |j: usize| robot.kind(j) == JointKind::Revolute;
    let largest =
        |k: usize| rows.values.iter().skip(k).step_by(rows.width).filter(|v| v.is_finite()).fold(0.0f64, |m, v| m.max(v.abs()));
    let beyond = columns.iter().enumerate().any(|(j, &k)| turns(j) && units[j].is_none() && largest(k) > RADIANS);
    let scale = |j: usize| match (units[j], turns(j)) {
        (Some(unit), _) => unit,
        (None, true) if beyond => DEG,
        _ => 1.0,
    };
    let mut track = JointTrack {
        name: name.into(),
        joints: columns.iter().map(|&k| titles[k].clone()).collect(),
        is_si: units.iter().all(Option::is_some),
        ..JointTrack::default()
    };
    for (row, t) in rows.values.chunks_exact(rows.width).zip(rows.times) {
        let positions: Vec<f64> = columns.iter().enumerate().map(|(j, &k)| row[k] * scale(j)).collect();
        if positions.iter().all(|v| v.is_finite()) {
            track.push(*t, *t, &positions);
        }
    }
    track
}

/// The columns of the joints from the base on.
fn joint_columns(titles: &[String], robot: &Robot, names: &[String]) -> Option<Vec<usize>> {
    if let Some(order) = order(titles, robot, names) {
        return Some(order);
    }
    let split = |title: &String| {
        let stem = without_unit(title).0.replace(['.', '[', ']', '(', ')', ' ', '-'], "_");
        let stem = stem.trim_end_matches('_');
        let name = stem.trim_end_matches(|c: char| c.is_ascii_digit());
        stem[name.len()..].parse::<usize>().ok().map(|number| (name.trim_end_matches('_').to_owned(), number))
    };
    let all: Vec<Option<(String, usize)>> = titles.iter().map(split).collect();
    let of = |wanted: &str| {
        let mut members: Vec<(usize, usize)> = Vec::new();
        for (k, found) in all.iter().enumerate() {
            match found {
                Some((name, number)) if name == wanted => members.push((*number, k)),
                _ => {}
            }
        }
        members.sort_unstable();
        let consecutive = members.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1);
        let begins = members.first().is_some_and(|(number, _)| *number <= 1);
        (members.len() == robot.joints() && consecutive && begins).then(|| members.into_iter().map(|(_, k)| k).collect())
    };
    NUMBERED.into_iter().find_map(of)
}

/// Seconds of a date and a time of day as text, or of a time of day alone.
fn date(text: &str) -> Option<f64> {
    /// Nanoseconds of a second.
    const NANOSECONDS: f64 = 1e9;
    let text = text.trim().trim_matches('"').trim_end_matches('Z').replace(' ', "T").replace(',', ".");
    let since =
        |at: civil::DateTime| at.to_zoned(TimeZone::UTC).ok().map(|at| at.timestamp().as_nanosecond() as f64 / NANOSECONDS);
    match text.parse::<civil::DateTime>() {
        Ok(at) if text.contains(':') => since(at),
        _ => text.parse::<civil::Time>().ok().filter(|_| text.contains(':')).and_then(|at| {
            let midnight = civil::Time::midnight();
            midnight.until(at).ok()?.total(Unit::Second).ok()
        }),
    }
}

/// A title in lower case without its unit, and the unit as written.
fn without_unit(title: &str) -> (String, String) {
    let lower = title.trim().trim_matches('"').to_lowercase();
    let bare = lower.trim_end_matches([')', ']']).to_owned();
    let units = UNITS.iter().map(|(unit, _)| *unit).chain(["deg", "°", "rad", "mm", "m"]);
    for unit in units {
        let Some(stem) = bare.strip_suffix(unit) else { continue };
        let rest = stem.trim_end_matches(['_', ' ', '(', '[', '/', '.', '-']);
        if rest.len() < stem.len() && !rest.is_empty() {
            return (rest.to_owned(), unit.to_owned());
        }
    }
    (lower, String::new())
}

/// SI units of the unit of a joint's title.
fn unit_of(title: &str) -> Option<f64> {
    match without_unit(title).1.as_str() {
        "deg" | "°" => Some(DEG),
        "mm" => Some(MM),
        "rad" | "m" => Some(1.0),
        _ => None,
    }
}

/// Seconds of the unit of times: that of the title, or else that in which they are times since 1970.
fn seconds(title: &str, times: &[f64]) -> f64 {
    let unit = without_unit(title).1;
    if let Some((_, seconds)) = UNITS.iter().find(|(name, _)| *name == unit) {
        return *seconds;
    }
    let first = times.first().copied().unwrap_or(0.0);
    // Whole numbers some of which are left out between two rows are milliseconds.
    let usual = period(times).unwrap_or(0.0);
    if first < SINCE_1970[2].0 && usual >= 2.0 && times.iter().all(|t| t.fract() == 0.0) {
        return 1e-3;
    }
    SINCE_1970.into_iter().find(|(least, _)| first >= *least).map_or(1.0, |(_, seconds)| seconds)
}

#[cfg(test)]
mod tests {
    use calibench::robot::built_in;

    use super::*;

    #[test]
    fn joints_are_found_by_their_titles() {
        let ur5 = built_in("ur5").expect("built in");
        let titles = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let rtde: Vec<String> = ["target_q_", "actual_q_", "actual_qd_", "actual_TCP_pose_"]
            .iter()
            .flat_map(|name| (0..6).map(move |k| format!("{name}{k}")))
            .collect();
        assert_eq!(joint_columns(&rtde, &ur5, &[]), Some((6..12).collect()));
        assert_eq!(
            joint_columns(&titles("t q1_deg q2_deg q3_deg q4_deg q5_deg q6_deg x y z"), &ur5, &[]),
            Some((1..7).collect())
        );
        let kuka = titles("Zeit $AXIS_ACT.A1 $AXIS_ACT.A2 $AXIS_ACT.A3 $AXIS_ACT.A4 $AXIS_ACT.A5 $AXIS_ACT.A6");
        assert!(joint_columns(&kuka, &ur5, &[]).is_some());
        assert_eq!(joint_columns(&titles("t x y z"), &ur5, &[]), None);
        assert!((seconds("timestamp", &[1.7e18]) - 1e-9).abs() < 1e-20);
        assert!((seconds("time_ms", &[12.0]) - 1e-3).abs() < 1e-12);
        assert!((seconds("time", &[0.0, 8.0, 16.0]) - 1e-3).abs() < 1e-12);
        assert_eq!(date("2026-11-28 07:30:00.25"), date("2026-11-28T07:30:00.25Z"));
        assert_eq!(date("00:01:02.5"), Some(62.5));
        assert_eq!(date("12"), None);
    }
}
