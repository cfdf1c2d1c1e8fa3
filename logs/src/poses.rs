//! Joints and what was measured then, as a table of text.

use crate::table::{Fields, READINGS, SCATTER, SIGMA, TIME};

/// An interval of a log that gives no row.
#[derive(Debug, Clone, PartialEq)]
pub struct Excluded {
    /// Its begin since the begin of the log, s.
    pub from_s: f64,
    /// Its end.
    pub to_s: f64,
    /// The reason.
    pub why: &'static str,
}

/// The rows of a log.
#[derive(Debug, Clone)]
pub struct MeasuredPoses {
    pub(crate) fields: Fields,
    pub(crate) measured: Vec<String>,
    /// Number of rows.
    pub rows: usize,
    /// Intervals that give no row.
    pub excluded: Vec<Excluded>,
    /// What was understood, a sentence each.
    pub said: Vec<String>,
    /// Time added to those of the instrument, s.
    pub shift_s: f64,
}

impl MeasuredPoses {
    /// Names of what was measured, in the order of its columns.
    pub fn measured(&self) -> &[String] {
        &self.measured
    }

    /// Joints and measurements as a table with titles.
    pub fn table(&self) -> String {
        self.fields.csv(false)
    }

    /// The same with the further columns: the time of each row, its number of readings and how they scatter, its one-sigma where
    /// that of the instrument is known, and the sign of each joint's last motion before it.
    pub fn whole_table(&self) -> String {
        self.fields.csv(true)
    }

    /// The lines of a column map that read the further columns.
    pub fn map_lines(&self) -> String {
        let line = |title: &String| match title.as_str() {
            TIME => format!("time = {{ column = \"{TIME}\", unit = \"s\" }}\n"),
            SIGMA => format!("sigma = {{ column = \"{SIGMA}\", unit = \"um\" }}\n"),
            READINGS | SCATTER => format!("extra_{title} = {{ column = \"{title}\", optional = true }}\n"),
            approach => format!("{approach} = {{ column = \"{approach}\" }}\n"),
        };
        self.fields.beside.iter().map(line).collect()
    }
}

/// The reasons for which intervals give no row, each with their number, in words.
pub(crate) fn reasons(excluded: &[Excluded]) -> String {
    let mut reasons: Vec<(&str, usize)> = Vec::new();
    for Excluded { why, .. } in excluded {
        match reasons.iter_mut().find(|(known, _)| known == why) {
            Some((_, count)) => *count += 1,
            None => reasons.push((why, 1)),
        }
    }
    let reasons: Vec<String> = reasons.iter().map(|(why, count)| format!("{count} where {}", sentence(why))).collect();
    if reasons.is_empty() { String::new() } else { format!("; not used: {}", reasons.join(", ")) }
}

fn sentence(why: &str) -> &str {
    if why == "too short after settling" { "the rest is too short after settling" } else { why }
}
