//! Information in the order of the rows if it is that of measurement: the side from which each joint came, and the time.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::ImportReport;
use crate::measure::dataset::{Dataset, Sample};

/// A joint that moves less than this, rad or m, has not moved: below the resolution of any controller.
const UNMOVED: f64 = 1e-6;

/// The table `[rows]` of a map: rows stand in the order of measurement.
#[derive(Deserialize, Debug, Clone, Copy, PartialEq)]
#[serde(deny_unknown_fields)]
pub(super) struct RowOrder {
    /// True if every joint came from where the row before had it.
    #[serde(default)]
    pub approach: bool,
    /// Time from one row to the next, s.
    pub interval_s: Option<f64>,
}

impl RowOrder {
    /// Fills in what the order says of samples, and reports it.
    pub fn apply(self, samples: &mut [Sample], report: &mut ImportReport) {
        let mut sessions: BTreeMap<Option<String>, Vec<usize>> = BTreeMap::new();
        for (i, sample) in samples.iter().enumerate() {
            sessions.entry(sample.session.clone()).or_default().push(i);
        }
        for places in sessions.values() {
            self.apply_to_session(samples, places);
        }
        if self.approach {
            report.notes.push(
                "the side from which each joint came is that of its last move from row to row; 0 before its first move".into(),
            );
        }
        if let Some(interval) = self.interval_s {
            report.notes.push(format!("times are those of rows every {interval} s, from the first row of each session on"));
        }
    }

    fn apply_to_session(self, samples: &mut [Sample], places: &[usize]) {
        let Some(&first) = places.first() else { return };
        let mut before = samples[first].q.clone();
        let mut sides = vec![0; before.len()];
        let (mut row, mut line) = (0, row_of(&samples[first]).to_owned());
        for &i in places {
            let sample = &mut samples[i];
            for ((side, now), before) in sides.iter_mut().zip(&sample.q).zip(&mut before) {
                let moved = now - *before;
                if moved.abs() > UNMOVED {
                    *side = if moved > 0.0 { 1 } else { -1 };
                }
                *before = *now;
            }
            // Several points of one row were measured at once.
            if row_of(sample) != line {
                (row, line) = (row + 1, row_of(sample).to_owned());
            }
            if self.approach {
                sample.approach = Some(sides.clone());
            }
            if let Some(interval) = self.interval_s {
                sample.time_s = Some(interval * f64::from(row));
            }
        }
    }
}

impl Dataset {
    /// States times for samples without any, in the order in which they stand: a row every so many seconds, from the first of each
    /// session on.
    pub fn state_times(&mut self, interval_s: f64) {
        let rows = RowOrder { approach: false, interval_s: Some(interval_s) };
        rows.apply(&mut self.samples, &mut ImportReport::default());
    }
}

/// The name of the row of a sample: that of a further point of the tool is `ROW/POINT`.
fn row_of(sample: &Sample) -> &str {
    match sample.tool_target {
        Some(_) => sample.id.rsplit_once('/').map_or(&sample.id, |(row, _)| row),
        None => &sample.id,
    }
}

/// Seconds since 1970 of a date and time of day written yyyymmddhhmmss; `None` if it is incomplete or invalid.
pub(super) fn timestamp(text: &str) -> Option<i64> {
    if text.len() != 14 || !text.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let part = |from: usize, to: usize| text[from..to].parse::<i64>().ok();
    let (year, month, day) = (part(0, 4)?, part(4, 6)?, part(6, 8)?);
    let (hour, minute, second) = (part(8, 10)?, part(10, 12)?, part(12, 14)?);
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days = match month {
        2 => 28 + i64::from(is_leap),
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => return None,
    };
    if !(1..=days).contains(&day) || hour > 23 || minute > 59 || second > 60 {
        return None;
    }
    // Days of the proleptic Gregorian calendar, counted in years that begin in March so that the leap day comes last.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + (153 * month + 2) / 5 + day
        - 1
        - 719_468;
    Some(((days * 24 + hour) * 60 + minute) * 60 + second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_is_counted_as_the_calendar_does() {
        // `date -u -d '...' +%s`
        for (text, seconds) in [
            ("19700101000000", 0),
            ("20200229235959", 1_583_020_799),
            ("20200301000000", 1_583_020_800),
            ("20200714163904", 1_594_744_744),
            ("21000301000000", 4_107_542_400),
        ] {
            assert_eq!(timestamp(text), Some(seconds), "{text}");
        }
        // 30 February, 31 April, and 29 February of years that are not leap years.
        let never = ["20200230000000", "20210431000000", "20210229000000", "21000229000000"];
        for text in ["2,02011E+13", "20201100000000", "2020071416390", "20200714246060"].into_iter().chain(never) {
            assert_eq!(timestamp(text), None, "{text}");
        }
    }
}
