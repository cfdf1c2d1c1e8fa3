//! The journal of a campaign: every finished probing is on the disk before the next begins, so that at most the one in progress
//! is lost.

mod entry;
mod lines;
mod place;

pub use entry::{JournalSession, ProbingEntry};
pub use place::refuse_measured;

use std::collections::VecDeque;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::conditions::Changed;
use crate::measure::dataset::file::write_dataset_with;

use self::entry::Entry;
use self::lines::{Broken, first_line, line, read_lines};
use self::place::{CAMPAIGN_JOURNAL, START_AGAIN, content, finished, free_or_own, probings};
use super::{CampaignRecord, Conditions};
use crate::files::disk::{sync_folder_of, write_whole};
use crate::files::{FileError, FileErrorKind, cannot_be_written};
use crate::measure::dataset::Dataset;
use crate::measure::dataset::clock_jump::ClockJump;
use crate::measure::poses::PlannedPose;

/// The journal of an unfinished campaign, beside the dataset to come, locked against other processes.
///
/// A line is written with one call and synced before the next probing begins. A line cut short by a kill, a power failure, or a
/// full disk is detected by its checksum, and dropped.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    folder: PathBuf,
    file: File,
    seal: String,
    /// Bytes of the intact part, and its lines.
    whole: u64,
    lines: usize,
    /// Entries noted before, and not yet recalled or repeated.
    before: VecDeque<Entry>,
    last_session: Option<JournalSession>,
    /// End of the content found on opening, by the wall clock.
    ended_wall_s: Option<f64>,
    /// Session and end of the last probing, on the cell's clock, as far as recalled or noted.
    session: Option<JournalSession>,
    ended_s: f64,
    done_before: usize,
    noted: usize,
    lived_through_again: bool,
    /// A line could not be written: the content of the disk after the last intact one is unknown.
    failed: bool,
}

/// Result of opening the journal of a campaign.
#[derive(Debug)]
#[non_exhaustive]
pub enum OpenedJournal {
    /// The journal is open for writing.
    Ready(Box<Journal>),
    /// The campaign was finished before; its dataset exists.
    Finished {
        /// Number of probings in it.
        probings: usize,
    },
    /// The motion of the cell may differ from that before the interruption. The journal is not open; to accept the change, call
    /// [`Journal::open_changed`].
    Changed {
        /// Descriptions of the changes.
        what: Vec<String>,
    },
}

/// Path of the journal of a dataset to come: beside its folder, with the extension `.journal`.
///
/// # Errors
/// When the path names no folder.
pub fn journal_path(folder: &Path) -> Result<PathBuf, FileError> {
    let name = folder.file_name().ok_or_else(|| FileError::whole(folder, "cannot be made", "name a new folder"))?;
    let mut name = name.to_owned();
    name.push(".journal");
    Ok(folder.with_file_name(name))
}

impl Journal {
    /// Opens the journal of the campaign that is to become the dataset `folder`, made under these conditions. If there is none
    /// it is created; one that contains probings is continued if `resume` is true, and refused otherwise.
    ///
    /// # Errors
    /// When there is already a dataset, or something else, unless it is of exactly this campaign; when the journal is of other
    /// conditions, damaged elsewhere than at its end, in use, or cannot be written.
    pub fn open(folder: &Path, conditions: &Conditions, resume: bool) -> Result<OpenedJournal, FileError> {
        Journal::open_with(folder, conditions, resume, false)
    }

    /// As [`Journal::open`], but continues with changed guards or speed of the cell, which is recorded.
    ///
    /// # Errors
    /// As [`Journal::open`].
    pub fn open_changed(folder: &Path, conditions: &Conditions) -> Result<OpenedJournal, FileError> {
        Journal::open_with(folder, conditions, true, true)
    }

    fn open_with(folder: &Path, conditions: &Conditions, resume: bool, accepts: bool) -> Result<OpenedJournal, FileError> {
        let path = journal_path(folder)?;
        if let Some(probings) = finished(folder, &path, conditions)? {
            return Ok(OpenedJournal::Finished { probings });
        }
        let mut file = locked(&path)?;
        // The process that held the lock may just have finished it.
        if let Some(probings) = finished(folder, &path, conditions)? {
            return Ok(OpenedJournal::Finished { probings });
        }
        let bytes = content(&mut file, &path)?;
        let Intact { seal, whole, entries, changed } = Intact::read(&bytes, &path, conditions, resume)?;
        if !changed.is_empty() && !accepts {
            return Ok(OpenedJournal::Changed { what: changed.iter().map(Changed::words).collect() });
        }
        let mut journal = Journal {
            folder: folder.into(),
            file,
            seal,
            whole: whole as u64,
            lines: 1 + entries.len(),
            ended_wall_s: ended_wall_s(&entries),
            last_session: entries.iter().rev().find_map(session_of),
            session: None,
            ended_s: entries.iter().map(ended_s).fold(0.0, f64::max),
            done_before: probings(&entries),
            noted: 0,
            before: entries.into(),
            lived_through_again: false,
            failed: false,
            path,
        };
        journal.begin(conditions).map_err(|e| cannot_be_written(&journal.path, e))?;
        if !changed.is_empty() {
            let entry = Entry::Conditions(conditions.clone());
            journal.append(&entry)?;
            journal.before.push_back(entry);
        }
        Ok(OpenedJournal::Ready(Box::new(journal)))
    }

    /// Seeks to the end of the last intact line; writes the first line if there is none.
    fn begin(&mut self, conditions: &Conditions) -> std::io::Result<()> {
        self.file.set_len(self.whole)?;
        self.file.seek(SeekFrom::Start(self.whole))?;
        if self.whole == 0 {
            let (line, seal) = first_line(conditions);
            self.file.write_all(line.as_bytes())?;
            (self.seal, self.whole) = (seal, line.len() as u64);
        }
        self.file.sync_all()?;
        sync_folder_of(&self.path)
    }

    /// Path of the journal.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of probings found on opening, including those that failed.
    pub fn done_before(&self) -> usize {
        self.done_before
    }

    /// Number of probings now.
    pub fn probings(&self) -> usize {
        self.done_before + self.noted
    }

    /// The session of its last probing; `None` before the first.
    pub fn last_session(&self) -> Option<&JournalSession> {
        self.last_session.as_ref()
    }

    /// The cell's clock when the campaign is resumed at this time by the wall clock (seconds since 1970, UTC): seconds since
    /// the first session began, and never before the end of the last probing, even if the wall clock was set back.
    pub fn clock_s(&self, wall_clock_s: f64) -> f64 {
        let first = self.before.iter().find_map(session_of).and_then(|session| session.wall_clock_s);
        first.map_or(0.0, |began| wall_clock_s - began).max(self.ended_s)
    }

    /// The jump of the wall clock between the measurements in the journal and `wall_clock_s` (seconds since 1970, UTC), if any:
    /// for a warning that names both times.
    pub fn clock_jump(&self, wall_clock_s: f64) -> Option<ClockJump> {
        ClockJump::between(self.ended_wall_s?, wall_clock_s)
    }

    /// For a simulated cell, which is created again every time: it repeats the probings of the journal, and they must be the
    /// same.
    pub fn live_through_again(&mut self) {
        self.lived_through_again = true;
    }

    /// Begins a session: the cell is ready, for the first time or again.
    ///
    /// # Errors
    /// When the journal cannot be written.
    pub fn begin_session(&mut self, session: JournalSession) -> Result<(), FileError> {
        self.last_session = Some(session.clone());
        let entry = Entry::Session(session.clone());
        if self.lived_through_again {
            self.session = Some(session);
            return self.live_through(&entry);
        }
        self.append(&entry)?;
        // It follows all entries still to be recalled.
        self.before.push_back(entry);
        Ok(())
    }

    /// Returns the probing made before an interruption, if any.
    ///
    /// # Errors
    /// When it is another probing, so that the journal is not of this plan.
    pub(super) fn recall(&mut self, pose: &PlannedPose, attempt: usize) -> Result<Option<ProbingEntry>, FileError> {
        if self.lived_through_again {
            return Ok(None);
        }
        loop {
            match self.before.pop_front() {
                None => return Ok(None),
                Some(Entry::Session(session)) => self.session = Some(session),
                Some(Entry::Conditions(_)) => {}
                Some(Entry::Probing(entry)) if entry.pose == pose.id && entry.attempt == attempt => return Ok(Some(entry)),
                Some(Entry::Probing(entry)) => {
                    let problem =
                        format!("has try {} of `{}` where try {attempt} of `{}` comes", entry.attempt, entry.pose, pose.id);
                    return Err(FileError::whole(&self.path, problem, START_AGAIN));
                }
            }
        }
    }

    /// Notes the end of a probing.
    ///
    /// # Errors
    /// When the journal cannot be written, or the probing differs from the one noted here before.
    pub(super) fn note(&mut self, entry: &ProbingEntry) -> Result<(), FileError> {
        self.live_through(&Entry::Probing(entry.clone()))
    }

    /// Session of the last probing, as named in samples.
    pub(super) fn session_name(&self) -> Option<String> {
        self.session.as_ref().and_then(JournalSession::name)
    }

    /// Appends a new entry; one noted before must be the same.
    fn live_through(&mut self, entry: &Entry) -> Result<(), FileError> {
        match self.before.pop_front() {
            None => self.append(entry),
            Some(before) if before == *entry => Ok(()),
            Some(_) => {
                // The first line contains the conditions, and later entries are still in the queue.
                let number = self.lines - self.before.len();
                let remedy = format!("go on with the program that wrote it; or {START_AGAIN}");
                Err(FileError {
                    line: Some(number),
                    ..FileError::whole(&self.path, "the simulated cell does not do this again", remedy)
                })
            }
        }
    }

    fn append(&mut self, entry: &Entry) -> Result<(), FileError> {
        let fail =
            |e: std::io::Error| FileError { remedy: "make room, or check the disk".into(), ..cannot_be_written(&self.path, e) };
        let Some(line) = line(&self.seal, self.lines + 1, entry) else {
            let remedy = "check what the devices answer";
            return Err(FileError::whole(&self.path, "a joint or reading is not a finite number", remedy));
        };
        if self.failed {
            return Err(fail(ErrorKind::BrokenPipe.into()));
        }
        if let Err(e) = self.file.write_all(line.as_bytes()).and_then(|()| self.file.sync_data()) {
            self.failed = true;
            let error = fail(e);
            // The rest of the line would be dropped anyway, and its room may be needed.
            drop(self.file.set_len(self.whole));
            return Err(error);
        }
        self.whole += line.len() as u64;
        self.lines += 1;
        self.noted += usize::from(matches!(entry, Entry::Probing(_)));
        Ok(())
    }

    /// Writes the dataset, which appears whole or not at all: beside its two files the journal, and `iterations.csv` and
    /// `probings.csv` for the replay ([`CampaignRecord::write`]). Then the journal beside it is removed.
    ///
    /// # Errors
    /// When the folder was created by somebody else meanwhile, or cannot be written: then the journal remains, with all
    /// measurements.
    pub fn finish(&mut self, dataset: &Dataset, record: &CampaignRecord, poses: &[PlannedPose]) -> Result<(), FileError> {
        free_or_own(&self.folder, &self.path)?;
        let journal = content(&mut self.file, &self.path)?;
        let names = [CAMPAIGN_JOURNAL, "iterations.csv", "probings.csv"];
        write_dataset_with(dataset, &self.folder, &names, |new| {
            record.write(new, poses, &dataset.ball_ids())?;
            write_whole(&new.join(CAMPAIGN_JOURNAL), &journal)
        })?;
        self.discard()
    }

    /// Removes the journal, and all that is not in a dataset.
    ///
    /// # Errors
    /// When the journal cannot be removed.
    pub fn discard(&mut self) -> Result<(), FileError> {
        let removed = std::fs::remove_file(&self.path).and_then(|()| sync_folder_of(&self.path));
        removed.map_err(|e| FileError::whole(&self.path, format!("cannot be removed: {e}"), "remove it by hand"))
    }
}

/// Opens or creates a journal, locked against other processes.
fn locked(path: &Path) -> Result<File, FileError> {
    let unwritable = |e: std::io::Error| cannot_be_written(path, e);
    if let Some(parent) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(parent).map_err(unwritable)?;
    }
    let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(unwritable)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            Err(FileError::whole(path, "is being written by another run", "wait for it, or name another dataset"))
        }
        Err(TryLockError::Error(e)) => Err(unwritable(e)),
    }
}

/// The part of a journal with which a campaign is continued; empty if it begins again.
#[derive(Default)]
struct Intact {
    seal: String,
    whole: usize,
    entries: Vec<Entry>,
    /// Acceptable differences of the conditions now.
    changed: Vec<Changed>,
}

impl Intact {
    /// Reads the content of a journal, and refuses what these conditions, or no wish to resume, do not allow to be continued.
    fn read(bytes: &[u8], path: &Path, conditions: &Conditions, resume: bool) -> Result<Self, FileError> {
        let lines = match read_lines(bytes) {
            Ok(lines) => lines,
            Err(Broken::Unbegun) => return Ok(Intact::default()),
            Err(broken) => return Err(broken.at(path)),
        };
        let mut changed = lines.conditions_now().changed(conditions);
        let not_acceptable = changed.iter().position(|c| !c.is_acceptable()).map(|k| changed.swap_remove(k));
        match (probings(&lines.entries), not_acceptable, changed.is_empty()) {
            // Nothing is lost with a journal without probings.
            (0, Some(_), _) | (0, None, false) => Ok(Intact::default()),
            (_, Some(changed), _) => Err(changed.at(path)),
            (1.., ..) if !resume => {
                let remedy = format!("resume it; or {START_AGAIN}");
                let error = FileError::whole(path, "holds a campaign that is not finished", remedy);
                Err(FileError { kind: FileErrorKind::UnfinishedCampaign, ..error })
            }
            _ => Ok(Intact { seal: lines.seal, whole: lines.whole, entries: lines.entries, changed }),
        }
    }
}

fn session_of(entry: &Entry) -> Option<JournalSession> {
    match entry {
        Entry::Session(session) => Some(session.clone()),
        Entry::Probing(_) | Entry::Conditions(_) => None,
    }
}

/// End of the last entry by the wall clock, which the cell's clock follows from the beginning of each session; `None` if no
/// session states its time.
fn ended_wall_s(entries: &[Entry]) -> Option<f64> {
    let (mut first, mut last, mut end_s) = (None, None, 0.0_f64);
    for entry in entries {
        if let Entry::Session(session) = entry {
            let wall = session.wall_clock_s?;
            let began = *first.get_or_insert(wall);
            // As in `clock_s`.
            last = Some((wall, (wall - began).max(end_s)));
        }
        end_s = end_s.max(ended_s(entry));
    }
    last.map(|(wall, clock_s)| wall + (end_s - clock_s).max(0.0))
}

fn ended_s(entry: &Entry) -> f64 {
    match entry {
        Entry::Conditions(_) => 0.0,
        Entry::Session(session) => session.mastering.time_s,
        Entry::Probing(entry) => entry.probing.started_s + entry.probing.duration_s,
    }
}
