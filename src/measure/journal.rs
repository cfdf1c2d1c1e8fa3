//! The journal of a campaign: every finished probing on the disk before the next begins, so that nothing but the one in hand is ever lost.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::conditions::Changed;
use super::dataset_file::write_dataset_with;
use super::journal_entry::{Entry, JournalSession, ProbingEntry};
use super::journal_lines::{Broken, first_line, line, read_lines};
use super::journal_place::{BEGIN_ANEW, CAMPAIGN_JOURNAL, content, finished, free_or_own, probings};
use super::{CampaignRecord, ClockJump, Conditions, Dataset, PlannedPose};
use crate::files::{FileError, cannot_be_written, sync_folder_of, write_whole};

/// The journal of a campaign that is not finished, beside the dataset to come. Nobody else can open it meanwhile.
///
/// A line is written with one call and synced before the next probing begins. A line that was cut, by a kill, a power cut, or a full disk,
/// is known by its checksum, and dropped.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    folder: PathBuf,
    file: File,
    seal: String,
    /// Bytes that are whole, and lines.
    whole: u64,
    lines: usize,
    /// What was noted before, and not yet recalled or lived through again.
    before: VecDeque<Entry>,
    last_session: Option<JournalSession>,
    /// End of what it held when it was opened, by the clock on the wall.
    ended_wall_s: Option<f64>,
    /// Session and end of the last probing, on the cell's clock, as far as recalled or noted.
    session: Option<JournalSession>,
    ended_s: f64,
    done_before: usize,
    noted: usize,
    lived_through_again: bool,
    /// A line could not be written: what the disk holds behind the last whole one is not known.
    failed: bool,
}

/// What came of opening the journal of a campaign.
#[derive(Debug)]
pub enum Opened {
    /// To be written to.
    Ready(Box<Journal>),
    /// The campaign was finished before; its dataset is there, with so many probings in it.
    Finished {
        /// How many.
        probings: usize,
    },
    /// The cell may move otherwise than when the campaign was interrupted. Nothing is open; who accepts that asks for
    /// [`Journal::open_changed`].
    Changed {
        /// What is otherwise, in words.
        what: Vec<String>,
    },
}

/// Where the journal of a dataset to come lies: beside its folder, with the ending `.journal`.
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
    /// The journal of the campaign that is to become the dataset `folder`, made under these conditions. A new one is begun; one that holds
    /// probings is gone on with where `resume` says so, and refused otherwise.
    ///
    /// # Errors
    /// When there is a dataset already, or something else, unless it is of just this campaign; when the journal is of other conditions,
    /// damaged elsewhere than at its end, in use, or cannot be written.
    pub fn open(folder: &Path, conditions: &Conditions, resume: bool) -> Result<Opened, FileError> {
        Journal::open_with(folder, conditions, resume, false)
    }

    /// The same, to go on though guards or speed of the cell were changed, which is noted.
    ///
    /// # Errors
    /// As [`Journal::open`].
    pub fn open_changed(folder: &Path, conditions: &Conditions) -> Result<Opened, FileError> {
        Journal::open_with(folder, conditions, true, true)
    }

    fn open_with(folder: &Path, conditions: &Conditions, resume: bool, accepts: bool) -> Result<Opened, FileError> {
        let path = journal_path(folder)?;
        if let Some(probings) = finished(folder, &path, conditions)? {
            return Ok(Opened::Finished { probings });
        }
        let unwritable = |e: std::io::Error| cannot_be_written(&path, &e);
        if let Some(parent) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent).map_err(unwritable)?;
        }
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path).map_err(unwritable)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(FileError::whole(&path, "is being written by another run", "wait for it, or name another dataset"));
            }
            Err(TryLockError::Error(e)) => return Err(unwritable(e)),
        }
        // Whoever held the lock may just have finished it.
        if let Some(probings) = finished(folder, &path, conditions)? {
            return Ok(Opened::Finished { probings });
        }
        let bytes = content(&mut file, &path)?;
        let nothing = (String::new(), 0, Vec::new());
        let mut accepted = false;
        let (seal, whole, entries) = match read_lines(&bytes) {
            Ok(lines) => {
                let mut changed = lines.conditions_now().changed(conditions);
                let not_acceptable = changed.iter().position(|c| !c.is_acceptable()).map(|k| changed.swap_remove(k));
                match (probings(&lines.entries), not_acceptable, changed.is_empty()) {
                    // Nothing is lost with a journal that holds no probing.
                    (0, Some(_), _) | (0, None, false) => nothing,
                    (_, Some(changed), _) => return Err(changed.at(&path)),
                    (1.., ..) if !resume => {
                        let remedy = format!("go on with `--resume`; or {BEGIN_ANEW}");
                        return Err(FileError::whole(&path, "holds a campaign that is not finished", remedy));
                    }
                    (_, None, false) if !accepts => {
                        return Ok(Opened::Changed { what: changed.iter().map(Changed::words).collect() });
                    }
                    (_, None, unchanged) => {
                        accepted = !unchanged;
                        (lines.seal, lines.whole, lines.entries)
                    }
                }
            }
            Err(Broken::Unbegun) => nothing,
            Err(broken) => return Err(broken.at(&path)),
        };
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
        journal.begin(conditions).map_err(|e| cannot_be_written(&journal.path, &e))?;
        if accepted {
            let entry = Entry::Conditions(conditions.clone());
            journal.append(&entry)?;
            journal.before.push_back(entry);
        }
        Ok(Opened::Ready(Box::new(journal)))
    }

    /// Behind the last whole line; with a first one, where there is none.
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

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Probings that it held when it was opened, those that failed among them.
    pub fn done_before(&self) -> usize {
        self.done_before
    }

    /// Probings that it holds now.
    pub fn probings(&self) -> usize {
        self.done_before + self.noted
    }

    /// The session of its last probing; `None` before the first.
    pub fn last_session(&self) -> Option<&JournalSession> {
        self.last_session.as_ref()
    }

    /// Where the cell's clock stands when it goes on at this time by the clock on the wall (seconds since 1970, UTC): seconds since the
    /// first session began, and never before the end of the last probing, though the wall clock may have been set back.
    pub fn clock_s(&self, wall_clock_s: f64) -> f64 {
        let first = self.before.iter().find_map(session_of).and_then(|session| session.wall_clock_s);
        first.map_or(0.0, |began| wall_clock_s - began).max(self.ended_s)
    }

    /// Whether the clock on the wall, which says `wall_clock_s` (seconds since 1970, UTC) now, was set since what the journal holds was
    /// measured: for a warning that names both times.
    pub fn clock_jump(&self, wall_clock_s: f64) -> Option<ClockJump> {
        ClockJump::between(self.ended_wall_s?, wall_clock_s)
    }

    /// A simulated cell is a new one every time: it lives through the probings of the journal again, and they must be the same.
    pub fn live_through_again(&mut self) {
        self.lived_through_again = true;
    }

    /// The cell is ready, now or again.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn begin_session(&mut self, session: JournalSession) -> Result<(), FileError> {
        self.last_session = Some(session.clone());
        let entry = Entry::Session(session.clone());
        if self.lived_through_again {
            self.session = Some(session);
            return self.live_through(&entry);
        }
        self.append(&entry)?;
        // It comes after all that is still to be recalled.
        self.before.push_back(entry);
        Ok(())
    }

    /// The probing that was done before an interruption, if it was.
    ///
    /// # Errors
    /// When another was, so that the journal is not of this plan.
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
                    return Err(FileError::whole(&self.path, problem, BEGIN_ANEW));
                }
            }
        }
    }

    /// A probing ended.
    ///
    /// # Errors
    /// When it cannot be written, or is not the one that ended here before.
    pub(super) fn note(&mut self, entry: &ProbingEntry) -> Result<(), FileError> {
        self.live_through(&Entry::Probing(entry.clone()))
    }

    /// Session of the last probing, as samples name it.
    pub(super) fn session_name(&self) -> Option<String> {
        self.session.as_ref().and_then(JournalSession::name)
    }

    /// Appends what is new; what was there before must be the same.
    fn live_through(&mut self, entry: &Entry) -> Result<(), FileError> {
        match self.before.pop_front() {
            None => self.append(entry),
            Some(before) if before == *entry => Ok(()),
            Some(_) => {
                // The first line holds the conditions, and those to come are still in the queue.
                let number = self.lines - self.before.len();
                let remedy = format!("go on with the program that wrote it; or {BEGIN_ANEW}");
                Err(FileError {
                    line: Some(number),
                    ..FileError::whole(&self.path, "the simulated cell does not do this again", remedy)
                })
            }
        }
    }

    fn append(&mut self, entry: &Entry) -> Result<(), FileError> {
        let fail = |e: std::io::Error| FileError {
            remedy: "make room, or check the disk".into(),
            ..cannot_be_written(&self.path, &e)
        };
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
            // What is left of the line would be dropped anyway; the room that it takes may be wanted.
            drop(self.file.set_len(self.whole));
            return Err(error);
        }
        self.whole += line.len() as u64;
        self.lines += 1;
        self.noted += usize::from(matches!(entry, Entry::Probing(_)));
        Ok(())
    }

    /// Writes the dataset, which appears whole or not at all: beside its two files the journal, and in it read by the replay
    /// `iterations.csv` and `probings.csv` ([`CampaignRecord::write`]). Then the journal beside it is removed.
    ///
    /// # Errors
    /// When the folder was made by somebody else meanwhile, or cannot be written: then the journal stays, and with it all that was measured.
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

    /// Removes it, and with it what is not in a dataset.
    ///
    /// # Errors
    /// When it cannot be removed.
    pub fn discard(&mut self) -> Result<(), FileError> {
        let removed = std::fs::remove_file(&self.path).and_then(|()| sync_folder_of(&self.path));
        removed.map_err(|e| FileError::whole(&self.path, format!("cannot be removed: {e}"), "remove it by hand"))
    }
}

fn session_of(entry: &Entry) -> Option<JournalSession> {
    match entry {
        Entry::Session(session) => Some(session.clone()),
        Entry::Probing(_) | Entry::Conditions(_) => None,
    }
}

/// When the last entry ended by the clock on the wall, which the cell's clock follows from the beginning of each session on; `None` where no
/// session says when it was.
fn ended_wall_s(entries: &[Entry]) -> Option<f64> {
    let (mut first, mut last, mut end_s) = (None, None, 0.0_f64);
    for entry in entries {
        if let Entry::Session(session) = entry {
            let wall = session.wall_clock_s?;
            let began = *first.get_or_insert(wall);
            // As `clock_s` has it.
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
