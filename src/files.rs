//! Files are written whole or not at all, and errors in them name the file, the line, the field and the remedy.

use std::borrow::Cow;
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

mod csv_table;
mod folder;
mod output;
mod rows;
mod toml_document;

pub use csv_table::{CsvRow, CsvTable};
pub use folder::replace_folder;
pub use output::{check_output_file, check_output_folder};
use output::{folder_of, target_of};
pub(crate) use rows::{Record, Rows};
pub use toml_document::{field_error, parse_toml};

/// What is wrong with a file, where, and what to do about it.
#[derive(Debug, Error)]
#[error("{}", one_line(&self.words()))]
pub struct FileError {
    /// The file.
    pub path: PathBuf,
    /// Line, counted from 1, where one is to blame.
    pub line: Option<usize>,
    /// Key or column.
    pub field: String,
    /// What is wrong.
    pub problem: String,
    /// What to do.
    pub remedy: String,
    /// Whose fault it is.
    pub fault: FileFault,
}

/// Whose fault an error of a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileFault {
    /// What was given: a path, a line, a field.
    Input,
    /// The disk that is to be written is full or fails.
    Disk,
}

impl FileError {
    fn words(&self) -> String {
        let FileError { path, line, field, problem, remedy, .. } = self;
        // A message that quotes all of a mangled file helps nobody.
        let [field, problem] = [shortened(field), shortened(problem)];
        let line = line.map(|l| format!(":{l}")).unwrap_or_default();
        let field = if field.is_empty() { String::new() } else { format!(": {field}") };
        format!("{}{line}{field}: {problem}; {remedy}", path.display())
    }

    /// An error of the whole file.
    pub fn whole(path: &Path, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (problem, remedy) = (problem.into(), remedy.into());
        FileError { path: path.into(), line: None, field: String::new(), problem, remedy, fault: FileFault::Input }
    }
}

/// Longest part of a message, characters.
const LONGEST_PART: usize = 600;

fn shortened(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(LONGEST_PART) {
        Some((end, _)) => Cow::Owned(format!("{} ...", &text[..end])),
        None => Cow::Borrowed(text),
    }
}

/// The text on one line: what a file or a flag holds may end lines or steer a terminal, and is quoted in errors.
pub fn one_line(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
}

/// Longest text file read whole, bytes: scenario, robot and calibration files are a thousand times shorter.
const LONGEST_TEXT: u64 = 64 << 20;

/// Opens a file to be read. A pipe would keep the program waiting for whoever may write to it, and a device need not end: neither is
/// opened.
///
/// # Errors
/// When there is no such file, it may not be read, or it is none.
pub fn open_file(path: &Path) -> std::io::Result<File> {
    let kind = std::fs::metadata(path)?;
    if !kind.is_file() && !kind.is_dir() {
        return Err(std::io::Error::new(ErrorKind::InvalidInput, "it is a pipe or a device, and not a file"));
    }
    File::open(path)
}

/// Reads a text file.
///
/// # Errors
/// When it cannot be read, is a directory, is empty, is longer than 64 MiB, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    if path.is_dir() {
        return Err(FileError::whole(path, "is a directory", "name a file"));
    }
    let mut bytes = Vec::new();
    open_file(path)
        .and_then(|file| file.take(LONGEST_TEXT + 1).read_to_end(&mut bytes))
        .map_err(|e| FileError::whole(path, format!("cannot be read: {e}"), "check the path and its permissions"))?;
    if bytes.len() as u64 > LONGEST_TEXT {
        return Err(FileError::whole(path, "is longer than 64 MiB", "check that it is the file you meant"));
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        FileError { line: Some(line), ..FileError::whole(path, "is not UTF-8 text", "save it as UTF-8") }
    })?;
    if let Some(at) = text.find('\0') {
        let line = 1 + text[..at].matches('\n').count();
        return Err(FileError {
            line: Some(line),
            ..FileError::whole(path, "is no text: it holds NUL bytes", "save it as UTF-8")
        });
    }
    if text.trim().is_empty() {
        return Err(FileError::whole(path, "is empty", "give a file with content"));
    }
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// Writes a file whole: to a temporary name in the same folder, synced, then renamed. A device or a pipe is written to as it is. Symbolic
/// links are followed; a file that is there keeps its permissions, and a new one gets those that the process gives (umask).
///
/// # Errors
/// When the folder cannot be written.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<(), FileError> {
    let fail = |e: std::io::Error| cannot_be_written(path, &e);
    // A device or a pipe is written to; a file put in its place would take it from everybody.
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        return std::fs::OpenOptions::new()
            .write(true)
            .open(path)
            .and_then(|mut device| device.write_all(content))
            .map_err(fail);
    }
    write_streamed(path, |file| file.write_all(content).map_err(fail))
}

/// Writes a file whole that is too long to be held at once: what `write` writes appears under its name when all of it is on the disk. For
/// the rest as [`write_whole`].
///
/// # Errors
/// What `write` meets, or when the folder cannot be written.
pub fn write_streamed<T>(
    path: &Path,
    write: impl FnOnce(&mut (dyn Write + Send)) -> Result<T, FileError>,
) -> Result<T, FileError> {
    let fail = |e: std::io::Error| cannot_be_written(path, &e);
    let target = target_of(path).map_err(fail)?;
    let folder = folder_of(&target);
    std::fs::create_dir_all(folder).map_err(fail)?;
    let mut file = new_file(&target).tempfile_in(folder).map_err(fail)?;
    let written = write(&mut file)?;
    file.as_file().sync_all().map_err(fail)?;
    file.persist(&target).map_err(|e| fail(e.error))?;
    Ok(written)
}

/// How a file comes to be that replaces `target`.
fn new_file(target: &Path) -> tempfile::Builder<'static, 'static> {
    #[cfg_attr(not(unix), allow(unused_mut))]
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let there = std::fs::metadata(target).map(|there| there.permissions().mode() & 0o777);
        // Read and write for everybody, less what the umask takes.
        builder.permissions(std::fs::Permissions::from_mode(there.unwrap_or(0o666)));
    }
    #[cfg(not(unix))]
    let _ = target;
    builder
}

/// That a file cannot be written, and why; a disk that is full or fails is to blame itself.
pub fn cannot_be_written(path: &Path, error: &(dyn std::error::Error + 'static)) -> FileError {
    let fault = if is_of_disk(error) { FileFault::Disk } else { FileFault::Input };
    let problem = format!("cannot be written: {error}");
    FileError { fault, ..FileError::whole(path, problem, "check the folder, its permissions and free space") }
}

/// Whether the system says that a disk is full or fails.
fn is_of_disk(error: &(dyn std::error::Error + 'static)) -> bool {
    let reasons = std::iter::successors(Some(error), |error| error.source());
    let mut of_system = reasons.filter_map(|reason| reason.downcast_ref::<std::io::Error>());
    of_system.any(|error| {
        let full = matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge);
        full || error.raw_os_error() == Some(INPUT_OUTPUT_ERROR)
    })
}

/// EIO of every Unix, which has no kind of its own; on Windows 5 is a refused access, which this must not take for it.
const INPUT_OUTPUT_ERROR: i32 = if cfg!(unix) { 5 } else { i32::MIN };

/// Bytes as hexadecimal digits, two each.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Makes sure that what was created, renamed or removed in the folder of `path` is on the disk.
pub(crate) fn sync_folder_of(path: &Path) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        std::fs::File::open(folder_of(path))?.sync_all()?;
    }
    Ok(())
}

/// The known name that `given` most likely meant: the same but for its unit, or a slip of the hand away.
pub fn nearest_name<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = given.to_lowercase();
    let distance = |name: &str| match unit_slip(&lower, name) {
        Some(_) => 0,
        None => strsim::damerau_levenshtein(&lower, name),
    };
    let nearest = known.into_iter().map(|name| (distance(name), name)).min_by_key(|(distance, _)| *distance);
    // A third of the letters wrong is a different word.
    nearest.filter(|(distance, name)| 3 * distance <= name.len().max(3)).map(|(_, name)| name)
}

/// What to do about a name that is not known: the unit it lacks, the name it is near to, or all there are.
pub fn name_remedy(given: &str, known: &[&str]) -> String {
    match nearest_name(given, known.iter().copied()) {
        Some(name) => match unit_slip(&given.to_lowercase(), name) {
            Some(UnitSlip::Missing) => format!("write `{name}`: the unit is part of the name"),
            Some(UnitSlip::Another) => format!("give it as `{name}`, in that unit"),
            None => format!("did you mean `{name}`?"),
        },
        None if known.is_empty() => "remove it".into(),
        None => format!("known here: {}", known.join(", ")),
    }
}

/// How a name differs from a known one, where it is only by its unit.
enum UnitSlip {
    Missing,
    Another,
}

fn unit_slip(given: &str, known: &str) -> Option<UnitSlip> {
    let (stem, _) = known.rsplit_once('_')?;
    if given == stem {
        Some(UnitSlip::Missing)
    } else {
        (given.rsplit_once('_')?.0 == stem && given != known).then_some(UnitSlip::Another)
    }
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::os::unix::fs::FileTypeExt;

    use super::*;

    /// `-o /dev/null`, by a user who may, once put a file in the place of the device.
    #[test]
    fn a_pipe_is_written_to_and_stays_a_pipe() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read(pipe).unwrap()
        });
        write_whole(&pipe, b"whole").unwrap();
        assert_eq!(reader.join().unwrap(), b"whole");
        assert!(std::fs::metadata(&pipe).unwrap().file_type().is_fifo());
    }
}
