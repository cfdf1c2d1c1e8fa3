//! Content of the place where a campaign is to be kept: nothing, its journal, its finished dataset, or something that must not
//! be touched.

use std::io::{Read, Seek};
use std::path::Path;

use super::Conditions;
use super::entry::Entry;
use super::lines::{Broken, read_lines};
use crate::files::disk::open_file;
use crate::files::{FileError, cannot_be_read};
use crate::measure::campaign::conditions::Changed;
use crate::measure::dataset::file::DATASET_TOML;

/// Refuses a folder that holds a measured campaign, whose measurements nothing but measuring makes again.
///
/// # Errors
/// When the folder holds one.
pub fn refuse_measured(folder: &Path) -> Result<(), FileError> {
    if !folder.join(CAMPAIGN_JOURNAL).exists() {
        return Ok(());
    }
    Err(FileError::whole(folder, "holds a measured campaign, which would be lost", "name another folder, or remove this one"))
}

/// Name of the journal in the dataset of a finished campaign.
pub(super) const CAMPAIGN_JOURNAL: &str = "campaign.journal";

/// Longest journal, bytes: thirty thousand probings of 2 kB.
const LONGEST: u64 = 64 << 20;

/// Remedy for a journal that cannot be continued.
pub(super) const START_AGAIN: &str = "name another dataset, or remove the journal to start again";

/// Number of probings of the finished campaign in the dataset, if it is this campaign and nothing remains to be done.
pub(super) fn finished(folder: &Path, journal: &Path, conditions: &Conditions) -> Result<Option<usize>, FileError> {
    free_or_own(folder, journal)?;
    let inside = folder.join(CAMPAIGN_JOURNAL);
    if journal.exists() || !inside.exists() {
        return Ok(None);
    }
    let mut file = open_file(&inside).map_err(|e| cannot_be_read(&inside, e))?;
    let lines = read_lines(&content(&mut file, &inside)?).map_err(|broken| broken.at(&inside))?;
    match lines.conditions_now().changed(conditions).into_iter().find(|changed| !changed.is_acceptable()) {
        Some(changed) => Err(changed.at(&inside)),
        None => Ok(Some(probings(&lines.entries))),
    }
}

/// Checks that the dataset's folder does not exist, is empty, or is the result of a campaign identified by its journal.
pub(super) fn free_or_own(folder: &Path, journal: &Path) -> Result<(), FileError> {
    let held = |what: &str| Err(FileError::whole(folder, format!("{what} already"), "name another folder, or remove this one"));
    if folder.is_file() {
        return Err(FileError::whole(folder, "is a file", "name a folder"));
    }
    let holds_something = folder.read_dir().is_ok_and(|mut entries| entries.next().is_some());
    match (holds_something, folder.join(CAMPAIGN_JOURNAL).is_file(), folder.join(DATASET_TOML).is_file()) {
        (false, ..) => Ok(()),
        (true, true, true) if !journal.exists() => Ok(()),
        // Killed between the last two steps: the dataset had appeared, but its journal was not yet removed.
        (true, true, true) if begins_alike(&folder.join(CAMPAIGN_JOURNAL), journal) => Ok(()),
        (true, _, true) => held("holds a dataset"),
        (true, _, false) => held("holds something"),
    }
}

/// True if two journals are the same, or one is the beginning of the other.
fn begins_alike(a: &Path, b: &Path) -> bool {
    let read = |path: &Path| open_file(path).ok().and_then(|mut file| content(&mut file, path).ok());
    read(a).zip(read(b)).is_some_and(|(a, b)| a.iter().zip(&b).all(|(a, b)| a == b))
}

/// Number of entries that are probings.
pub(super) fn probings(entries: &[Entry]) -> usize {
    entries.iter().filter(|entry| matches!(entry, Entry::Probing(_))).count()
}

impl Changed {
    pub(super) fn at(self, path: &Path) -> FileError {
        let problem = match self.name.as_str() {
            "plan" => "is of another plan".into(),
            "cell" => "is of another cell: its robot, tool, balls or payloads were described otherwise".into(),
            _ => {
                let shown = |value: Option<String>| value.unwrap_or_else(|| "not given".into());
                format!("was {}, and is {} now", shown(self.was), shown(self.is))
            }
        };
        let remedy = format!("go on under the conditions that it was begun with; or {START_AGAIN}");
        FileError { line: Some(1), field: self.name, ..FileError::whole(path, problem, remedy) }
    }
}

impl Broken {
    pub(super) fn at(&self, path: &Path) -> FileError {
        let at = |line: usize, problem: &str, remedy: String| FileError {
            line: Some(line),
            ..FileError::whole(path, problem, remedy)
        };
        match *self {
            Broken::Damaged(1) => at(1, "the line is not as it was written", format!("restore it; or {START_AGAIN}")),
            Broken::Damaged(line) => {
                let remedy = "restore it; or remove this line and all after it, whose probings are then done again";
                at(line, "the line is not as it was written", remedy.into())
            }
            Broken::Unknown(line) => {
                at(line, "the line says something unknown", "read it with the program that wrote it".into())
            }
            Broken::Unbegun | Broken::Foreign => {
                FileError::whole(path, "is not a journal of a campaign", "name another dataset")
            }
        }
    }
}

pub(super) fn content(file: &mut (impl Read + Seek), path: &Path) -> Result<Vec<u8>, FileError> {
    let mut bytes = Vec::new();
    file.rewind()
        .and_then(|()| file.by_ref().take(LONGEST + 1).read_to_end(&mut bytes))
        .map_err(|e| cannot_be_read(path, e))?;
    if bytes.len() as u64 > LONGEST {
        return Err(FileError::whole(path, "is longer than 64 MiB", "check that it is the file you meant"));
    }
    Ok(bytes)
}
