//! The file of a study's rows: complete trials in order. An interrupted study continues after the last complete one.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Take, Write};
use std::path::{Path, PathBuf};

use calibench::files::disk::open_file;
use calibench::files::{FileError, cannot_be_read, cannot_be_written as unwritable};
use calibench_sim::run::Methods;
use csv::StringRecord;

use super::Study;
use super::extent::Extent;
use super::rows::METHODS;

/// Sequential reader of a study's rows, which checks that each is in its place.
pub struct RowsReader {
    path: PathBuf,
    reader: csv::Reader<Take<File>>,
    record: StringRecord,
    header: StringRecord,
    place: Places,
    /// Rows read.
    rows: u64,
    first: RowOfStudy,
    /// Byte offset after the last complete trial.
    whole: u64,
    /// The last line has no end.
    is_cut: bool,
}

/// Columns that determine the place of a row.
#[derive(Clone, Copy)]
struct Places {
    points: usize,
    point: usize,
    trial: usize,
    method: usize,
    methods: usize,
}

/// Properties of the study, from the first row.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct RowOfStudy {
    study: String,
    points: u64,
    trial: u64,
    methods: Methods,
}

impl RowsReader {
    /// Opens a file of rows. An incomplete last line is not read; see [`RowsReader::cut_line`].
    ///
    /// # Errors
    /// If it cannot be read or is not a table of a study.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let file = open_file(path).map_err(|e| cannot_be_read(path, e))?;
        Self::of(file, path)
    }

    fn of(mut file: File, path: &Path) -> Result<Self, FileError> {
        let end = end_of_lines(&mut file).map_err(|e| cannot_be_read(path, e))?;
        let is_cut = file.metadata().map_err(|e| cannot_be_read(path, e))?.len() > end;
        let mut reader = csv::Reader::from_reader(file.take(end));
        let header = reader.headers().map_err(|e| not_csv(path, &e))?.clone();
        let at = |name: &str| header.iter().position(|h| h == name);
        let (Some(points), Some(point), Some(trial), Some(method), Some(methods)) =
            (at("points"), at("point"), at("trial"), at("method"), at(METHODS))
        else {
            return Err(FileError::whole(
                path,
                "is not a table of a study",
                "name a file that `sim study` wrote, or a new one",
            ));
        };
        let place = Places { points, point, trial, method, methods };
        let whole = reader.position().byte();
        Ok(RowsReader {
            path: path.into(),
            reader,
            record: StringRecord::new(),
            header,
            place,
            rows: 0,
            first: RowOfStudy::default(),
            whole,
            is_cut,
        })
    }

    /// Names of the columns.
    pub fn header(&self) -> &StringRecord {
        &self.header
    }

    /// Reads the next row, in a table in which every row is in its place.
    ///
    /// # Errors
    /// If a row is not the expected one.
    pub fn next_row(&mut self) -> Result<Option<&StringRecord>, FileError> {
        if !self.reader.read_record(&mut self.record).map_err(|e| not_csv(&self.path, &e))? {
            return Ok(None);
        }
        let number = |column: usize| self.record.get(column).and_then(|v| v.parse::<u64>().ok());
        let Places { points, point, trial, method, methods } = self.place;
        let by = |record: &StringRecord| Methods::named(record.get(methods).unwrap_or_default());
        if self.rows == 0
            && let (Some(points), Some(trial), Some(methods)) = (
                number(points).filter(|p| (1..=Extent::END).contains(p)),
                number(trial).filter(|t| *t <= Extent::END),
                by(&self.record),
            )
        {
            self.first = RowOfStudy { study: self.record[0].to_owned(), points, trial, methods };
        }
        let per_trial = self.rows_per_trial();
        let of_trial = self.rows % per_trial.max(1);
        let each = self.first.methods.each();
        let here = RowOfStudy {
            study: self.record[0].to_owned(),
            points: number(points).unwrap_or(0),
            trial: number(trial).unwrap_or(0),
            methods: by(&self.record).unwrap_or_default(),
        };
        let must = RowOfStudy { trial: self.first.trial + self.rows / per_trial.max(1), ..self.first.clone() };
        let in_place = per_trial > 0
            && here == must
            && number(point) == Some(of_trial / each.len() as u64)
            && self.record.get(method) == Some(each[of_trial as usize % each.len()]);
        if !in_place {
            return Err(self.changed("trial", "is not the row that must follow"));
        }
        if let Some(column) = self.record.iter().position(is_no_finite_number) {
            let problem = format!("`{}` is not a finite number", &self.record[column]);
            return Err(self.changed(self.header.get(column).unwrap_or_default(), &problem));
        }
        self.rows += 1;
        if self.is_whole() {
            self.whole = self.reader.position().byte();
        }
        Ok(Some(&self.record))
    }

    /// The last row as the error of a table that is not as a study wrote it.
    fn changed(&self, field: &str, problem: &str) -> FileError {
        let line = self.record.position().map(|p| p.line() as usize);
        let remedy = "the table was changed after it was written: make it again";
        FileError { line, field: field.into(), ..FileError::whole(&self.path, problem, remedy) }
    }

    fn rows_per_trial(&self) -> u64 {
        self.first.points * self.first.methods.each().len() as u64
    }

    /// Name and fingerprint of the study, after the first row.
    pub fn study(&self) -> &str {
        &self.first.study
    }

    /// Number of its points, after the first row.
    pub fn points(&self) -> u64 {
        self.first.points
    }

    /// The complete trials read so far.
    pub fn extent(&self) -> Extent {
        Extent { first: self.first.trial, trials: self.rows.checked_div(self.rows_per_trial()).unwrap_or(0) }
    }

    /// Number of the incomplete last line, if there is one, once all lines before it are read.
    pub fn cut_line(&self) -> Option<usize> {
        self.is_cut.then(|| self.reader.position().line() as usize)
    }

    /// True if the rows read so far end with a complete trial.
    pub fn is_whole(&self) -> bool {
        self.rows.checked_rem(self.rows_per_trial()) == Some(0)
    }
}

/// A file to which rows are appended.
pub struct RowsFile {
    path: PathBuf,
    file: File,
    /// Number of trials already in it.
    pub found: u64,
}

impl RowsFile {
    /// Opens the file of a study for these trials: a new one, or one begun by the same study, whose remaining rows are passed
    /// to `row`. The file is locked against other writers.
    ///
    /// # Errors
    /// If the file is of another study or of other trials, is in use, or cannot be written.
    pub fn open(path: &Path, study: &Study, extent: Extent, mut row: impl FnMut(&StringRecord)) -> Result<Self, FileError> {
        let unwritable = |e: std::io::Error| unwritable(path, e);
        if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(unwritable)?;
        }
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(unwritable)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(FileError::whole(path, "is being written by another run", "wait for it, or name another file"));
            }
            Err(TryLockError::Error(e)) => return Err(unwritable(e)),
        }
        let header = study.columns.header();
        let mut found = 0;
        // A file without a complete line is an interrupted start if it begins like this one.
        let begun = end_of_lines(&mut file).map_err(unwritable)? > 0;
        let mut there = Vec::new();
        (&file).take(header.len() as u64).read_to_end(&mut there).map_err(unwritable)?;
        if !begun && header.starts_with(&there) {
            file.set_len(0).and_then(|()| file.rewind()).and_then(|()| file.write_all(&header)).map_err(unwritable)?;
        } else {
            file.rewind().map_err(unwritable)?;
            let mut reader = RowsReader::of(file.try_clone().map_err(unwritable)?, path)?;
            let other =
                |problem: String| Err(FileError::whole(path, problem, "remove it to start again, or name another file"));
            // The rows of an incomplete trial are dropped.
            let mut pending = Vec::new();
            while let Some(record) = reader.next_row()? {
                pending.push(record.clone());
                if reader.study() != study.id {
                    return other(format!("contains trials of {}, which is not {} as it is now", reader.study(), study.id));
                }
                if reader.extent().trials > extent.trials {
                    return other(format!("contains more than {} trials", extent.trials));
                }
                if reader.is_whole() {
                    pending.drain(..).for_each(|r| row(&r));
                }
            }
            if there != header {
                return other("contains the trials of another study".into());
            }
            if reader.rows > 0 && reader.first.trial != extent.first {
                return other(format!("begins with trial {}, not {}", reader.first.trial, extent.first));
            }
            found = reader.extent().trials;
            let whole = reader.whole;
            file.set_len(whole).and_then(|()| file.seek(SeekFrom::Start(whole))).map_err(unwritable)?;
        }
        Ok(RowsFile { path: path.into(), file, found })
    }

    /// Appends complete rows.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn append(&mut self, rows: &[u8]) -> Result<(), FileError> {
        self.file.write_all(rows).map_err(|e| unwritable(&self.path, e))
    }

    /// Flushes everything to the disk.
    ///
    /// # Errors
    /// If that fails.
    pub fn finish(self) -> Result<(), FileError> {
        self.file.sync_all().map_err(|e| unwritable(&self.path, e))
    }
}

/// Byte offset after the last complete line; leaves the file at its beginning.
fn end_of_lines(file: &mut File) -> std::io::Result<u64> {
    /// Size of the blocks in which the file is read from its end, bytes.
    const STEP: u64 = 1 << 16;
    let mut end = file.seek(SeekFrom::End(0))?;
    let mut block = Vec::new();
    while end > 0 {
        let from = end.saturating_sub(STEP);
        file.seek(SeekFrom::Start(from))?;
        block.clear();
        Read::by_ref(file).take(end - from).read_to_end(&mut block)?;
        if let Some(last) = block.iter().rposition(|&b| b == b'\n') {
            end = from + last as u64 + 1;
            break;
        }
        end = from;
    }
    file.rewind()?;
    Ok(end)
}

/// True of a number that a study never writes: where it has none, it leaves the field empty.
fn is_no_finite_number(text: &str) -> bool {
    let first = text.trim_start_matches(['-', '+']).as_bytes().first();
    matches!(first, Some(b'n' | b'N' | b'i' | b'I')) && text.parse::<f64>().is_ok_and(|v| !v.is_finite())
}

fn not_csv(path: &Path, e: &csv::Error) -> FileError {
    let line = e.position().map(|p| p.line() as usize);
    FileError { line, ..FileError::whole(path, format!("is not a table: {e}"), "name a file that `sim study` wrote") }
}
