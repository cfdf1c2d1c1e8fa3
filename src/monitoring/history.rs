//! The history of a robot: the checks since its calibration, each with its date, its dataset and its verdict.

#[cfg(not(target_family = "wasm"))]
mod lock;

#[cfg(not(target_family = "wasm"))]
pub use lock::HistoryLock;

use std::path::{Path, PathBuf};

use jiff::Timestamp;
use jiff::civil::Date;
use jiff::tz::TimeZone;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::files::disk::write_whole;
use crate::files::{FileError, field_error, parse_toml, read_text};
use crate::measure::dataset::file::read_dataset;
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::monitoring::check::charts::Charts;
use crate::monitoring::check::{CheckError, CheckReference, RobotCheck, rows_again};

/// Format tag.
pub const HISTORY_FORMAT: &str = "calibench-history/1";

/// The verdicts of a check.
const VALID: &str = "valid";
const CHANGED: &str = "changed";

/// The history file of a robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct History {
    format: String,
    /// The calibration that is checked, relative to this file.
    calibration: PathBuf,
    /// The campaign with which all checks are compared, relative to this file.
    then: PathBuf,
    /// Digests of the numbers of both, against which all checks were judged; files of older versions have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    calibration_digest: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    then_digest: Option<String>,
    /// The checks, the oldest first.
    #[serde(default)]
    pub check: Vec<CheckEntry>,
}

/// A check in a history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckEntry {
    /// Day on which it was measured, `YYYY-MM-DD`.
    pub on: String,
    /// Its dataset, relative to the file.
    pub dataset: PathBuf,
    /// `valid` or `changed`.
    pub verdict: String,
    /// The most probable change, if something has changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<String>,
    /// Its probability.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probability: Option<f64>,
}

/// Reason why a check cannot be added to a history.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum HistoryError {
    /// It is older than the last check.
    #[error("{on}: the last check in {} is of {last}", history.display())]
    Older {
        /// Its day.
        on: String,
        /// The history.
        history: PathBuf,
        /// Day of the last check.
        last: String,
    },
    /// Its dataset is in the history already.
    #[error("{} is in {} already, as the check of {on}", dataset.display(), history.display())]
    Repeated {
        /// Its dataset.
        dataset: PathBuf,
        /// The history.
        history: PathBuf,
        /// Day of the check of that dataset.
        on: String,
    },
}

impl History {
    /// Reads the history of a calibration and the campaign that it is compared with, given with the digests of both; an empty
    /// one if there is no file.
    ///
    /// # Errors
    /// If the file is invalid, or of another calibration or campaign, be they of the same names.
    pub fn read(path: &Path, calibration: &Path, then: &Path, digests: &[String; 2]) -> Result<Self, FileError> {
        let [calibration_digest, then_digest] = digests.clone().map(Some);
        let new = History {
            format: HISTORY_FORMAT.into(),
            calibration: relative(path, calibration),
            then: relative(path, then),
            calibration_digest,
            then_digest,
            check: Vec::new(),
        };
        if !path.exists() {
            return Ok(new);
        }
        let text = read_text(path)?;
        let history: History = parse_toml(path, &text)?;
        if history.format != HISTORY_FORMAT {
            return Err(field_error(
                path,
                &text,
                "format",
                format!("is '{}'", history.format),
                format!("write '{HISTORY_FORMAT}'"),
            ));
        }
        let other = [("calibration", &history.calibration, &new.calibration), ("then", &history.then, &new.then)]
            .into_iter()
            .find(|(_, was, is)| was != is);
        if let Some((field, was, is)) = other {
            let problem = format!("is {}, and this check is of {}", was.display(), is.display());
            return Err(field_error(path, &text, field, problem, "begin another history for another calibration or campaign"));
        }
        let other = [
            ("calibration_digest", "calibration", &history.calibration_digest, &new.calibration_digest),
            ("then_digest", "campaign", &history.then_digest, &new.then_digest),
        ]
        .into_iter()
        .find(|(_, _, was, is)| was.is_some() && was != is);
        if let Some((field, what, ..)) = other {
            let problem = format!("its checks were judged against another {what} of the same name");
            return Err(field_error(path, &text, field, problem, "begin a new history"));
        }
        match history.check.iter().enumerate().find_map(|(k, _)| history.wrong_entry(k)) {
            Some((field, problem, remedy)) => Err(field_error(path, &text, &field, problem, remedy)),
            None => {
                let History { calibration_digest, then_digest, .. } = new;
                Ok(History { calibration_digest, then_digest, ..history })
            }
        }
    }

    /// The error in a check, by its index: the key, the problem, the remedy.
    fn wrong_entry(&self, k: usize) -> Option<(String, String, &'static str)> {
        let entry = &self.check[k];
        let wrong = |key: &str, problem: String, remedy| Some((format!("check[{k}].{key}"), problem, remedy));
        if day(&entry.on).is_err() {
            return wrong("on", format!("is '{}'", entry.on), "write a date as 2026-11-24");
        }
        if let Some(before) = self.check[..k].last().filter(|before| before.on > entry.on) {
            return wrong("on", format!("is {}, after {}", entry.on, before.on), "put the checks in their order");
        }
        if let Some(same) = self.check[..k].iter().find(|other| plain(&other.dataset) == plain(&entry.dataset)) {
            let problem = format!("is {}, which is the check of {} already", entry.dataset.display(), same.on);
            return wrong("dataset", problem, "list every dataset once");
        }
        if ![VALID, CHANGED].contains(&entry.verdict.as_str()) {
            return wrong("verdict", format!("is '{}'", entry.verdict), "write `valid` or `changed`");
        }
        if entry.condition.is_some() != (entry.verdict == CHANGED) {
            let problem = "is of a check that found a change, and only of such a one";
            return wrong("condition", problem.into(), "correct the verdict or the condition");
        }
        if entry.probability.is_some_and(|p| !(0.0..=1.0).contains(&p)) {
            return wrong("probability", "is not a probability".into(), "write a number from 0 to 1");
        }
        None
    }

    /// Adds a check.
    ///
    /// # Errors
    /// If it is older than the last one, or its dataset is in the history.
    pub fn add(&mut self, path: &Path, on: &str, folder: &Path, check: &RobotCheck) -> Result<(), HistoryError> {
        if let Some(last) = self.check.last().filter(|last| last.on.as_str() > on) {
            return Err(HistoryError::Older { on: on.into(), history: path.into(), last: last.on.clone() });
        }
        let dataset = relative(path, folder);
        if let Some(same) = self.check.iter().find(|entry| plain(&entry.dataset) == dataset) {
            return Err(HistoryError::Repeated { dataset: folder.into(), history: path.into(), on: same.on.clone() });
        }
        let named = check.named();
        self.check.push(CheckEntry {
            on: on.into(),
            dataset,
            verdict: if check.changed { CHANGED } else { VALID }.into(),
            condition: named.map(|j| j.condition.name()),
            probability: named.map(|j| (j.probability * 1e4).round() / 1e4),
        });
        Ok(())
    }

    /// The condition of each check, and whether something had changed.
    pub fn verdicts(&self) -> Vec<(String, bool)> {
        self.check.iter().map(|entry| (entry.condition.clone().unwrap_or_default(), entry.verdict == CHANGED)).collect()
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        let text = toml::to_string(self).map_err(|e| FileError::whole(path, e.to_string(), "give paths in Unicode"))?;
        write_whole(path, text.as_bytes())
    }

    /// The datasets of all checks but the last, which is `now`, and the control charts of all.
    ///
    /// # Errors
    /// If a dataset cannot be read any more, or not be compared, or if the last one is a copy of another.
    pub fn charts(
        &self,
        path: &Path,
        reference: &CheckReference<'_>,
        now: &Dataset,
    ) -> Result<Result<Charts, CheckError>, FileError> {
        let beside = path.parent().unwrap_or(Path::new(""));
        let earlier = &self.check[..self.check.len().saturating_sub(1)];
        let read: Vec<Dataset> =
            earlier.iter().map(|entry| read_dataset(&beside.join(&entry.dataset))).collect::<Result<_, _>>()?;
        let copied = earlier.iter().zip(&read).find_map(|(entry, before)| Some((entry, rows_again(now, before)?)));
        if let (Some((entry, rows)), Some(last)) = (copied, self.check.last()) {
            let problem = format!("{rows} of its rows are also those of the check of {}", entry.on);
            let remedy = "the same measurements are not a second check: measure again";
            return Err(FileError::whole(&beside.join(&last.dataset).join("samples.csv"), problem, remedy));
        }
        let NamedDataset { name, .. } = reference.campaign();
        let checks: Vec<NamedDataset<'_>> = read.iter().chain([now]).map(|dataset| NamedDataset::new(name, dataset)).collect();
        Ok(Charts::of(reference, &checks))
    }
}

/// Checks that a text is a day of the calendar.
///
/// ```
/// use calibench::monitoring::history::day;
///
/// assert_eq!(day("2026-11-24").as_deref(), Ok("2026-11-24"));
/// assert!(day("24.11.2026").is_err() && day("2026-02-30").is_err());
/// ```
///
/// # Errors
/// The reason why it is not one.
pub fn day(text: &str) -> Result<String, String> {
    let parsed =
        text.parse::<toml::value::Datetime>().ok().filter(|d| d.date.is_some() && d.time.is_none() && d.offset.is_none());
    parsed.map(|_| text.to_owned()).ok_or_else(|| format!("'{text}' is not a date; write it as 2026-11-24"))
}

/// As [`day`], for a day that has come somewhere on earth: tomorrow in UTC is allowed.
///
/// # Errors
/// The reason why it is not one.
pub fn day_until_now(text: &str) -> Result<String, String> {
    let text = day(text)?;
    let today = Timestamp::now().to_zoned(TimeZone::UTC).date();
    let has_come = text.parse::<Date>().is_ok_and(|date| today.tomorrow().is_ok_and(|tomorrow| date <= tomorrow));
    if has_come { Ok(text) } else { Err(format!("'{text}' is after today, {today}; give the day on which it was measured")) }
}

/// The path without `.` components.
fn plain(path: &Path) -> PathBuf {
    path.components().filter(|part| *part != std::path::Component::CurDir).collect()
}

/// A path as seen from the folder of a file; absolute if they have nothing in common.
fn relative(file: &Path, to: &Path) -> PathBuf {
    let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let folder = whole(file).parent().map(Path::to_path_buf).unwrap_or_default();
    let to = to.canonicalize().unwrap_or_else(|_| whole(to));
    let folder = folder.canonicalize().unwrap_or(folder);
    let common = folder.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    if common <= 1 {
        return to;
    }
    let up = folder.components().skip(common).map(|_| PathBuf::from(".."));
    up.chain(to.components().skip(common).map(|part| PathBuf::from(part.as_os_str()))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_seen_from_the_file() {
        let seen = |file: &str, to: &str| relative(Path::new(file), Path::new(to)).display().to_string();
        assert_eq!(seen("/none/a/history.toml", "/none/a/runs/monday"), "runs/monday");
        assert_eq!(seen("/none/a/b/history.toml", "/none/a/runs"), "../runs");
        assert_eq!(seen("/none/a/history.toml", "/other/runs"), "/other/runs");
    }

    #[test]
    fn days_are_days() {
        assert!(day("2026-02-28").is_ok());
        for text in ["2026-02-30", "24.11.2026", "2026-11-24T10:00:00Z", "10:00:00", ""] {
            assert!(day(text).is_err(), "{text}");
        }
    }
}
